"""A folder in which builds are killed, and what must hold there whatever happens to them.

A recipe has two states: built with ``--set`` one way and another. Commands run in forks of this
process, which has imported all that a build needs: that is what makes thousands of them quick.
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import cv2

from fire_atlas.cli import main
from fire_atlas.core.shipped import shipped
from fire_atlas.outputs.digest import tool_digest
from fire_atlas.outputs.recovery import staging_folder
from tests.campaign.forks import code_of, fork

RECIPE: dict[str, Any] = {
    "source": {"path": "clip"},
    "timeline": {"loop": "none"},
    "flakes": {"rate": 60, "alpha": 0.01},
    "motion_blur": "none",
    "maps": {"flame": True},
    "exports": ["json", "godot", "unity", {"template": "shared.j2", "to": "shared.txt"}],
}
"""Has flakes, a layer, two engines with their import settings, and a file shared with another."""

OTHER = {**RECIPE, "flakes": "none", "maps": {}, "exports": RECIPE["exports"][-1:]}
"""Built into the same folder: writes the same ``shared.txt``."""

OLD = ("--set", "seed=1", "--set", "atlas.max_size=48")
NEW = (
    "--set", "seed=2", "--set", "atlas.max_size=4096", "--set", "tracks=[csv, light]",
    "--set", "exports=[json, css, godot, unity]",
)  # fmt: skip
"""Files of all kinds are replaced, added and removed between the two."""

USERS = MappingProxyType({"mine.txt": b"mine", "fire-9.png": b"painted", ".hidden": b"mine too"})
"""Files of the user's own among the outputs."""


class Stage:
    """A recipe, its two whole states, and what else lies in the folder of its outputs.

    Attributes:
        others: Name and bytes of files that no command may touch: the user's, and the outputs of
            another recipe.
        old, new: Name and bytes of all files after a build in either way.
        shelf: A copy of the folder as it is after the old build.
        temporary: The folder for temporary files of its commands.
        said: What the last command printed on stderr.
        journals: A file that is there during the commit.
        next: What a person may do next.
    """

    def __init__(self, folder: Path, **keys: Any) -> None:
        """Build both ways in ``folder``; ``keys`` are more keys of the recipe."""
        tool_digest()  # looked at once: the code may be edited while a campaign runs
        self.folder = folder
        self.out = folder / "build"
        self.recipe = folder / "fire.yaml"
        self.temporary = folder / "temporary"
        self.temporary.mkdir()
        self.said = folder / "said"
        self.journals = (staging_folder(self.out, "fire").journal,)
        self.next = NEXT
        self._make_clip()
        self.recipe.write_text(json.dumps({**RECIPE, **keys}))
        self.others = self._built_beside()
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

    def _built_beside(self) -> Mapping[str, bytes]:
        self.out.mkdir()
        for name, data in USERS.items():
            (self.out / name).write_bytes(data)
        (self.folder / "shared.j2").write_text("of both")
        other = self.folder / "other.yaml"
        other.write_text(json.dumps(OTHER))
        assert main(["build", str(other), "-q"]) == 0
        return self.contents()

    def _state_of(self, options: tuple[str, ...]) -> Mapping[str, bytes]:
        shutil.rmtree(self.out)
        self.out.mkdir()
        for name, data in self.others.items():
            (self.out / name).write_bytes(data)
        # In this process, so that forks of it find all imported that a build needs.
        assert main(["build", str(self.recipe), "-q", *options]) == 0
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
        line = [command, str(self.recipe), "-q", *options]
        return fork(line, self.said, self.temporary, before)

    def start_new(self, before: Callable[[], None] = lambda: None) -> int:
        """Start the build that makes the new state of the old one."""
        return self.start("build", *NEW, before=before)

    def victims(self, pid: int) -> list[int]:
        """Return the processes of the new build, which is the process ``pid``."""
        return [pid]

    def run(self, command: str, *options: str) -> int:
        """Run a command in a fork and return its exit code; negative where a signal ended it."""
        return code_of(self.start(command, *options))

    def faults_after_death(self) -> list[str]:
        """Return what is wrong before anything is put right."""
        faults = self._lost()
        for name, data in self.contents().items():
            if not name.startswith(".fire-atlas") and not _is_whole(name, data, self.old, self.new):
                faults.append(f"{name} is neither the old file nor the new one")
        for manifest in self.out.glob("*.manifest.json"):
            for entry in json.loads(manifest.read_bytes())["outputs"]:
                path = self.out / entry["path"]
                data = path.read_bytes() if path.exists() else b""
                if hashlib.sha256(data).hexdigest() != entry["sha256"]:
                    faults.append(f"{manifest.name} vouches for other bytes of {path.name}")
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
        faults = self._lost()
        if shown not in [dict(state) for state in states]:
            faults.append(f"a mixed or wrong state: {_nearest(shown, states)}")
        if left and not litter:
            faults.append(f"litter: {left}")
        return faults

    def faults_whole(self, *states: Mapping[str, bytes]) -> list[str]:
        """Return what is wrong if the new build, which was not killed, has left none of
        ``states``."""
        return self.faults_after(*states)

    def _lost(self) -> list[str]:
        """Return a line for each file that no command may touch and that is not as it was."""
        now = self.contents()
        return [
            f"{name}, which is not the recipe's, is gone or changed"
            for name, data in self.others.items()
            if now.get(name) != data
        ]

    def then(self, command: str) -> list[str]:
        """Run the next command and return what is wrong after it."""
        match command:
            case "check":
                code, states = self.run("check"), [self.old, self.new]
            case "clean":
                code, states = self.run("clean"), [self.others]
            case "build old":
                code, states = self.run("build", *OLD), [self.old]
            case _:
                code, states = self.run("build", *NEW), [self.new]
        faults = [] if code == 0 else [f"exit code {code}: {self.said.read_text()}"]
        if command != "check":
            faults += [f"{path} is left" for path in self.temporary.iterdir()]
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


def _is_whole(name: str, data: bytes, *states: Mapping[str, bytes]) -> bool:
    """Return whether a file is in one of ``states`` as it is."""
    return any(state.get(name) == data for state in states)
