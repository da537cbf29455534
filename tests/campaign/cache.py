"""Entries of a cache that are damaged, forged, or no files at all, and servers that fall silent.

Whatever a cache holds, a build with it succeeds and leaves the outputs of a build, or, where an
entry is forged with a sound seal, others under names that the build writes; and the next build can
use the cache.
"""

import json
import os
import shutil
import socket
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from fire_atlas.cli import main
from fire_atlas.pipeline.files.expected import possible
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.tree import read_tree
from tests.campaign.forks import seconds_of
from tests.campaign.mutations import Chance, spoilt_bytes, spoilt_json
from tests.campaign.stage import NEW, Stage
from tests.support.entries import described, forge, header, taken_apart
from tests.support.silent_server import SILENCES, silent_server

_ROWS = {"damaged": 300, "hostile": 150, "special": 20, "silent": 6}
"""Tries of a whole campaign."""

_SECONDS_OVER = 12
"""By how much a silent server may lengthen builds."""

_PLANTED = (
    "fire.Editor.cs", "fire.gd", "fire_plugin.gd", "fire.exe", "fire.dll", "fire.so", "fire.js",
    "fire.png.exe", "fire-1.gd", "fire.gd.uid", "fire.asmdef", "fire.tres.gd", "plugin.cfg",
    "other.png", ".fire.png", "fire.bat", "FIRE.PNG", "fire-2.png.dylib", "other.manifest.json",
    "../fire.png", "a/fire.png", "C:fire.png", "nul.png", "mine.txt", "fire-1.png",
)  # fmt: skip
"""Names of files that are put into entries; the build writes only the last one."""

_MINE = {"mine.txt": b"mine", "fire-1.png": b"painted"}
"""Files of the user's."""


class Scene:
    """A recipe, what a build of it writes, and a cache that holds this.

    Attributes:
        good: Name and bytes of all files after a build.
        entry: The file in the cache.
        sound: Its bytes.
    """

    def __init__(self, folder: Path) -> None:
        self.stage = Stage(folder)
        self.out, cache = folder / "out", folder / "cache"
        self._options = ("-o", str(self.out), "--cache", str(cache), *NEW)
        self._recipe = load_checked(read_tree(self.stage.recipe, NEW[1::2])).recipe
        assert self.build() == 0
        self.good: Mapping[str, bytes] = MappingProxyType(self._contents())
        (self.entry,) = cache.iterdir()
        self.sound = self.entry.read_bytes()

    def build(self) -> int:
        """Build into a folder that holds nothing but files of the user's; return the exit code."""
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()
        for name, data in _MINE.items():
            (self.out / name).write_bytes(data)
        return self.stage.run("build", *self._options)

    def clear(self) -> None:
        """Remove the entry, whatever is in its place."""
        if self.entry.is_dir() and not self.entry.is_symlink():
            shutil.rmtree(self.entry)
        else:
            self.entry.unlink(missing_ok=True)

    def faults(self, *, may_differ: bool = False) -> list[str]:
        """Build with the cache as it is, and once more; return what goes wrong.

        ``may_differ``: an entry with other outputs may be taken, if the build writes such names.
        """
        faults = list[str]()
        for _ in range(2):
            if code := self.build():
                faults.append(f"exit code {code}")
            now = self._contents()
            if any(now.get(name) != data for name, data in _MINE.items()):
                faults.append("a file of the user's is gone or changed")
            foreign = now.keys() - _MINE.keys() - set(possible(self._recipe, now))
            if foreign:
                faults.append(f"wrote {sorted(foreign)}")
            if not may_differ and now != self.good:
                faults.append("wrong outputs")
        if not self.entry.is_file() or self.entry.is_symlink():
            faults.append("what is no entry was not replaced")
        if not may_differ and main(["cache", "info", str(self.entry.parent), "-q"]):
            faults.append("the cache cannot be described")
        return faults

    def _contents(self) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in self.out.iterdir()}


def _damaged(scene: Scene, _: int, chance: Chance) -> list[str]:
    scene.clear()
    scene.entry.write_bytes(spoilt_bytes(scene.sound, chance))
    return scene.faults()


def _hostile(scene: Scene, number: int, chance: Chance) -> list[str]:
    """Forge an entry whose seal holds."""
    scene.clear()
    scene.entry.write_bytes(scene.sound)
    manifest, outputs = taken_apart(scene.entry)
    members = [(header(name, len(data)), data) for name, data in outputs.items()]
    name, data = str(chance.choice(_PLANTED)), b"planted"
    role = str(chance.choice([entry["role"] for entry in manifest["outputs"]]))
    match number % 6:
        case 0 | 1:  # a file more
            manifest["outputs"].append(described(name, role, data))
            members.append((header(name, len(data)), data))
        case 2:  # a file fewer, or none
            left = int(chance.integers(0, len(members)))
            del manifest["outputs"][left:], members[left:]
        case 3:  # a member that is no file, or another one
            at = int(chance.integers(0, len(members)))
            types = [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.DIRTYPE, tarfile.CHRTYPE, b"S", b"x"]
            odd = header(members[at][0].name, 0, types[int(chance.integers(0, len(types)))])
            odd.linkname = "/etc/passwd"
            members[at] = odd, b""
        case 4:  # a file under another name or in another role
            entry = manifest["outputs"][int(chance.integers(0, len(members)))]
            entry[str(chance.choice(["path", "role"]))] = name
        case _:
            bent = spoilt_json(json.dumps(manifest).encode(), chance)
            forge(scene.entry, bent, members)
            return scene.faults(may_differ=True)
    forge(scene.entry, manifest, members)
    return scene.faults(may_differ=True)


def _special(scene: Scene, number: int, _: Chance) -> list[str]:
    """Put what is no file in the place of the entry."""
    scene.clear()
    kinds: list[Callable[[Path], object]] = [
        lambda path: path.mkdir(),
        lambda path: (path / "in" / "it").mkdir(parents=True),
        os.mkfifo,
        lambda path: path.symlink_to(path),
        lambda path: path.symlink_to("/dev/zero"),
        lambda path: path.symlink_to("/dev/full"),
        lambda path: path.symlink_to("nowhere"),
        lambda path: path.symlink_to(path.parent),
        lambda path: path.write_bytes(b""),
        _make_socket,
    ]
    kinds[number % len(kinds)](scene.entry)
    return scene.faults()


def _make_socket(path: Path) -> None:
    at = os.getcwd()  # noqa: PTH109 - the name of a socket is short, so it is given from beside it
    os.chdir(path.parent)
    try:
        socket.socket(socket.AF_UNIX).bind(path.name)
    finally:
        os.chdir(at)


def _silent(scene: Scene, number: int, _: Chance) -> list[str]:
    """Build one recipe, or eight at once, with a server that falls silent."""
    answer = list(SILENCES.values())[number % 3]
    folder = scene.stage.folder / "recipes"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    keys = json.loads(scene.stage.recipe.read_bytes())
    keys |= {"source": {"path": "../clip"}, "exports": ["json"]}
    for i in range(1 if number < 3 else 8):
        (folder / f"fire{i}.yaml").write_text(json.dumps(keys | {"seed": i}))
    command = [sys.executable, "-m", "fire_atlas", "build", str(folder), "--force"]
    ordinary = seconds_of(lambda: subprocess.run(command, check=True, capture_output=True))
    shutil.rmtree(folder / "build")
    with silent_server(answer) as url:
        begun = time.monotonic()
        done = subprocess.run(
            [*command[:-1], "--cache", url], check=False, capture_output=True, text=True
        )
        over = time.monotonic() - begun - ordinary
    faults = [] if done.returncode == 0 else [f"exit code {done.returncode}: {done.stderr}"]
    if over > _SECONDS_OVER:
        faults.append(f"took {over:.1f} s over the {ordinary:.1f} s of an ordinary build")
    if (times := done.stderr.count(url)) != 1:
        faults.append(f"named the server {times} times: {done.stderr}")
    return faults


_ATTEMPTS: Mapping[str, Callable[[Scene, int, Chance], list[str]]] = {
    "damaged": _damaged, "hostile": _hostile, "special": _special, "silent": _silent,
}  # fmt: skip
"""What each row tries, with its number."""


def run(count: int | None, seed: int) -> list[str]:
    """Try ``count`` entries of all kinds, print how many of each were tried and went wrong, and
    return the faults. Silent servers, which take 10 s each, are part of whole campaigns only."""
    faults = list[str]()
    with tempfile.TemporaryDirectory(prefix="cache-") as folder:
        scene = Scene(Path(folder))
        for kind, tries in (_ROWS if count is None else _share(count)).items():
            wrong = 0
            for number in range(tries):
                chance = np.random.default_rng((seed, number))
                found = _ATTEMPTS[kind](scene, number, chance)
                faults += [f"{kind} {number}: {fault}" for fault in found]
                wrong += bool(found)
            print(f"{tries:7} {kind}: {wrong} wrong", flush=True)
    return faults


def _share(count: int) -> dict[str, int]:
    total = sum(_ROWS.values())
    shares = {kind: max(1, round(count * tries / total)) for kind, tries in _ROWS.items()}
    return {kind: share for kind, share in shares.items() if kind != "silent"}
