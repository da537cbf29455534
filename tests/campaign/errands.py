"""Commands other than ``build`` that write files, each in a folder of its own."""

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fire_atlas.outputs.recovery import staging_folder
from tests.campaign import corpus
from tests.campaign.forks import code_of, fork

_HIDDEN = ".fire-atlas"
"""How the names of the tool's own hidden files begin."""


@dataclass(frozen=True, slots=True)
class Errand:
    """A command that writes files over those of an earlier one.

    Attributes:
        prepare: Puts what the command needs into a folder.
        new: Arguments of the command; ``@`` stands for the folder.
        old: Those of the command that wrote the files which it replaces; none if there are none.
        age: Makes what the older command wrote that of an older version of the tool, if anything.
        stagings: Folders that get files, and the name under which they wait there.
    """

    prepare: Callable[[Path], None]
    new: tuple[str, ...]
    old: tuple[str, ...] = ()
    age: Callable[[Path], None] | None = None
    stagings: tuple[tuple[str, str], ...] = ()


class ErrandStage:
    """An errand, and all that is in its folder before and after it.

    It has what a ``Stage`` has: one can be killed like the other.
    """

    def __init__(self, folder: Path, errand: Errand) -> None:
        """Run the older command and the newer one in ``folder``."""
        self.folder = folder
        self.out = folder / "project"
        self.said = folder / "said"
        self.temporary = folder / "temporary"
        self.journals = tuple(
            staging_folder(self.out / each, name).journal for each, name in errand.stagings
        )
        self.next = ("old", "new") if errand.old and errand.age is None else ("new",)
        self._lines = {
            name: [word.replace("@", str(self.out)) for word in words]
            for name, words in (("old", errand.old), ("new", errand.new))
        }
        self.temporary.mkdir()
        self.out.mkdir()
        (self.out / "mine.txt").write_bytes(b"mine")
        errand.prepare(self.out)
        if errand.old:
            self._succeed("old")
        if errand.age:
            errand.age(self.out)
        self.old: Mapping[str, bytes] = self._contents()
        self._shelf = folder / "shelf"
        shutil.copytree(self.out, self._shelf)
        self._succeed("new")
        self.new: Mapping[str, bytes] = self._contents()

    def reset(self) -> None:
        """Put the folder back to what it was before the newer command."""
        shutil.rmtree(self.out)
        shutil.copytree(self._shelf, self.out)

    def start_new(self, before: Callable[[], None] = lambda: None) -> int:
        """Start the newer command; return its process id."""
        return fork(self._lines["new"], self.said, self.temporary, before)

    def victims(self, pid: int) -> list[int]:
        """Return the processes of the newer command, which is the process ``pid``."""
        return [pid]

    def faults_after_death(self) -> list[str]:
        """Return what is wrong before anything is put right: no file may be half written."""
        return [
            f"{name} is neither the old file nor the new one"
            for name, data in self._contents().items()
            if _HIDDEN not in name and data not in (b"", self.old.get(name), self.new.get(name))
        ]

    def then(self, command: str) -> list[str]:
        """Run the next command and return what is wrong after it."""
        code = code_of(fork(self._lines[command], self.said, self.temporary))
        faults = [] if code == 0 else [f"exit code {code}: {self.said.read_text()}"]
        return faults + self.faults_whole(self.old if command == "old" else self.new)

    def faults_whole(self, *states: Mapping[str, bytes]) -> list[str]:
        """Return what is wrong if the folder has to be in one of ``states``, with no litter."""
        now = self._contents()
        faults = [f"{path} is left" for path in self.temporary.iterdir()]
        if now not in states:
            differing = [
                sorted(name for name in now.keys() | state if now.get(name) != state.get(name))
                for state in states
            ]
            names = min(differing, key=len)
            faults.append(f"a mixed or wrong state of {len(names)} files: {names[:4]}")
        return faults

    def _contents(self) -> dict[str, bytes]:
        """Return every file, and folders as files without bytes, by their paths."""
        return {
            str(path.relative_to(self.out)): path.read_bytes() if path.is_file() else b""
            for path in self.out.rglob("*")
        }

    def _succeed(self, command: str) -> None:
        code, said = corpus.command(*self._lines[command])
        assert code == 0, said


def _clips(folder: Path) -> None:
    corpus.write_clip(folder / "take1", 10)
    corpus.write_clip(folder / "take2", 9)


def _recipe(folder: Path) -> None:
    corpus.write_clip(folder / "clip")
    keys = {"source": {"path": "clip"}, "flakes": {"rate": 30, "alpha": 0.01}}
    (folder / "fire.yaml").write_text(json.dumps(keys))
    (folder / "build").mkdir()


def _godot_project(folder: Path) -> None:
    (folder / "project.godot").write_text(
        'config_version=5\n\n[application]\nconfig/features=PackedStringArray("4.3")\n'
    )


def _unity_project(folder: Path) -> None:
    for name in ("Assets", "Packages", "ProjectSettings"):
        (folder / name).mkdir()


def _age_add_on(folder: Path) -> None:
    """Make the add-on that of an older version: other bytes, and a file that was since removed."""
    for path in folder.rglob("*.manifest.json"):
        manifest = json.loads(path.read_bytes())
        manifest["tool"] = "fire-atlas 0.0.1"
        for entry in manifest["outputs"]:
            if entry["role"] == "engine":
                _rewrite(path.parent, entry, (path.parent / entry["path"]).read_bytes() + b"\n\n")
        gone: dict[str, Any] = {"path": "gone.txt", "role": "engine"}
        _rewrite(path.parent, gone, b"of an older version")
        manifest["outputs"].append(gone)
        path.write_text(json.dumps(manifest))


def _rewrite(folder: Path, entry: dict[str, Any], data: bytes) -> None:
    (folder / str(entry["path"])).write_bytes(data)
    entry |= {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}


_UNITY = "Packages/com.fire-atlas.unity"

ERRANDS: Mapping[str, Errand] = {
    "learn": Errand(
        _clips,
        ("learn", "@/take2", "-o", "@/fire.profile.json", "--overwrite", "-q"),
        ("learn", "@/take1", "-o", "@/fire.profile.json", "--overwrite", "-q"),
        stagings=((".", "fire.profile.json"),),
    ),
    "preview": Errand(
        _recipe,
        ("preview", "@/fire.yaml", "--background", "#ffffff", "-q"),
        ("preview", "@/fire.yaml", "--background", "#000000", "-q"),
    ),
    "preview --gif": Errand(
        _recipe,
        ("preview", "@/fire.yaml", "--gif", "--background", "#ffffff", "--overwrite", "-q"),
        ("preview", "@/fire.yaml", "--gif", "--background", "#000000", "--overwrite", "-q"),
    ),
    "init": Errand(
        lambda _: None,
        ("init", "campfire", "@", "-q"),
        stagings=(("samples/campfire", "campfire"), (".", "campfire")),
    ),
    "plugin godot": Errand(
        _godot_project,
        ("plugin", "godot", "@", "-q"),
        ("plugin", "godot", "@", "-q"),
        _age_add_on,
        (("addons/fire_atlas", "fire_atlas"),),
    ),
    "plugin unity": Errand(
        _unity_project,
        ("plugin", "unity", "@", "-q"),
        ("plugin", "unity", "@", "-q"),
        _age_add_on,
        tuple(
            (folder, "com.fire-atlas.unity")
            for folder in (_UNITY, f"{_UNITY}/Editor", f"{_UNITY}/Runtime")
        ),
    ),
}
"""The errands, by name."""
