"""A folder in which builds are killed, and what must hold there whatever happens to them.

A recipe has two states: built with ``--set`` one way and another. Commands run in forks of this
process, which has imported all that a build needs: that is what makes thousands of them quick.
"""

import hashlib
import json
import os
import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn

import cv2

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.outputs.digest import tool_digest

OLD = ("--set", "seed=1", "--set", "atlas.max_size=48")
NEW = ("--set", "seed=2", "--set", "atlas.max_size=4096", "--set", "exports=[json, css]")

USERS = MappingProxyType({"mine.txt": b"mine", "fire-9.png": b"painted", ".hidden": b"mine too"})
"""Files of the user's own among the outputs."""

_NEEDED = (
    "filelock", "fire_atlas.pipeline.build", "fire_atlas.pipeline.check", "fire_atlas.cli.build",
    "fire_atlas.cli.check", "fire_atlas.cli.clean", "fire_atlas.formats.atlas.texture_packer",
    "fire_atlas.formats.templates.export",
    "fire_atlas.outputs.recovery", "fire_atlas.sources.frames",
)  # fmt: skip


class Stage:
    """A recipe, a folder of outputs with files of the user's in it, and its two whole states."""

    def __init__(self, folder: Path) -> None:
        for module in _NEEDED:
            import_module(module)
        tool_digest()  # looked at once: the code may be edited while a campaign runs
        self.folder = folder
        self.out = folder / "build"
        self.recipe = folder / "fire.yaml"
        self._make_clip()
        self.recipe.write_text(json.dumps({"source": {"path": "clip"}, "flakes": "none"}))
        self.new = self._state_of(NEW)
        self.old = self._state_of(OLD)
        self.shelf = folder / "shelf"
        shutil.copytree(self.out, self.shelf)

    def _make_clip(self) -> None:
        clip = self.folder / "clip"
        clip.mkdir()
        for i, path in enumerate(sorted((shipped("samples") / "campfire").glob("*.png"))[:4]):
            image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
            assert image is not None
            cv2.imwrite(str(clip / f"{i}.png"), cv2.resize(image, (32, 40)))

    def _state_of(self, options: tuple[str, ...]) -> Mapping[str, bytes]:
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()
        for name, data in USERS.items():
            (self.out / name).write_bytes(data)
        assert self.run("build", *options) == 0
        return self.contents()

    def reset(self) -> None:
        """Put the folder back to the older good build."""
        shutil.rmtree(self.out)
        shutil.copytree(self.shelf, self.out)

    def contents(self) -> dict[str, bytes]:
        """Return every file in the folder, and hidden folders as files without bytes."""
        return {
            path.name: path.read_bytes() if path.is_file() else b"" for path in self.out.iterdir()
        }

    def start(self, command: str, *options: str, before: Callable[[], None] = lambda: None) -> int:
        """Start a command in a fork, after ``before`` was called there; return its process id."""
        sys.stdout.flush()
        pid = os.fork()
        if pid == 0:
            self._become(command, options, before)
        return pid

    def run(self, command: str, *options: str) -> int:
        """Run a command in a fork and return its exit code; negative where a signal ended it."""
        return code_of(self.start(command, *options))

    def _become(
        self, command: str, options: tuple[str, ...], before: Callable[[], None]
    ) -> NoReturn:
        code = 99
        try:
            silent = os.open(os.devnull, os.O_WRONLY)
            os.dup2(silent, 1)
            os.dup2(silent, 2)
            before()
            code = main([command, str(self.recipe), "-q", *options])
        finally:
            os._exit(code)

    def faults_after_death(self) -> list[str]:
        """Return what is wrong before anything is put right."""
        faults = [f"{name} of the user's is gone or changed" for name in self._lost()]
        manifest = self.out / "fire.manifest.json"
        for entry in json.loads(manifest.read_bytes())["outputs"] if manifest.exists() else []:
            path = self.out / entry["path"]
            data = path.read_bytes() if path.exists() else b""
            if hashlib.sha256(data).hexdigest() != entry["sha256"]:
                faults.append(f"the manifest vouches for other bytes of {path.name}")
        return faults

    def faults_after(self, *states: Mapping[str, bytes], litter: bool = False) -> list[str]:
        """Return what is wrong if the folder has to be in one of ``states``.

        Args:
            states: Name and bytes of all files.
            litter: Hidden files of the tool's own may be there too.
        """
        now = self.contents()
        left = [name for name in now if name.startswith(".fire-atlas")]
        shown = {name: data for name, data in now.items() if name not in left}
        faults = [f"{name} of the user's is gone or changed" for name in self._lost()]
        if shown not in [dict(state) for state in states]:
            faults.append(f"a mixed or wrong state: {_nearest(shown, states)}")
        if left and not litter:
            faults.append(f"litter: {left}")
        return faults

    def _lost(self) -> list[str]:
        paths = {name: self.out / name for name in USERS}
        return [
            n for n, path in paths.items() if not path.exists() or path.read_bytes() != USERS[n]
        ]

    def then(self, command: str) -> list[str]:
        """Run the next command and return what is wrong after it."""
        match command:
            case "check":
                code, states = self.run("check"), [self.old, self.new]
            case "clean":
                code, states = self.run("clean"), [USERS]
            case "build old":
                code, states = self.run("build", *OLD), [self.old]
            case _:
                code, states = self.run("build", *NEW), [self.new]
        faults = [] if code == 0 else [f"exit code {code}"]
        return faults + self.faults_after(*states, litter=command == "check")


NEXT = ("check", "clean", "build old", "build new")
"""What a person may do next."""


def _nearest(now: Mapping[str, bytes], states: Sequence[Mapping[str, bytes]]) -> list[str]:
    """Return the names of the files that differ from the state that is most like ``now``."""
    differing = (
        sorted(name for name in now.keys() | state if now.get(name) != state.get(name))
        for state in states
    )
    return min(differing, key=len)


def code_of(pid: int) -> int:
    """Wait for a process and return its exit code; negative where a signal ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def seconds_of(act: Callable[[], object]) -> float:
    """Return how long something takes."""
    begun = time.monotonic()
    act()
    return time.monotonic() - begun
