"""Folders that are exchanged for a link while a build runs: to the outputs, of files that wait, and
of the recipe.

The link leads to a folder of the user's with files under the same names. Every other time it comes
right before one of the build's file operations, else at a random instant. Then the next build runs,
with the link still there. Wrong is a file of the user's that is gone, changed or new, and an error
that nobody had thought of.
"""

import random
import shutil
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from fire_atlas.outputs.recovery import staging_folder
from tests.campaign.forks import code_of, is_careless, seconds_of
from tests.campaign.operations import Operations, operations_of
from tests.campaign.rows import chosen, run_rows
from tests.campaign.stage import Stage

_MOVES = {"unlink", "replace", "rename", "rmdir"}
"""Operations that change or remove names: every other exchange before an operation is before one of
these."""

_TRIES = {"build": 20, "staging": 20, "recipe": 20}
"""Tries of a whole campaign, by the folder that is exchanged."""


def run(count: int | None, seed: int) -> list[str]:
    """Try ``count`` exchanges drawn by chance, or all."""
    return run_rows(exchanged, chosen(_TRIES, count, seed), seed)


def exchanged(kind: str, numbers: Sequence[int], seed: int) -> list[list[str]]:
    """Exchange one kind of folder; return what was wrong each time."""
    with tempfile.TemporaryDirectory(prefix="exchanged-") as above:
        scene = _Scene(Path(above), kind)
        return [scene.try_(number, random.Random(f"{seed} {kind} {number}")) for number in numbers]


class _Scene:
    """A recipe, a folder that will be exchanged, and the user's folder that the link leads to."""

    def __init__(self, above: Path, kind: str) -> None:
        project = above / "project"
        project.mkdir()
        self.stage = Stage(project)
        self.stage.said = above / "said"
        self.stage.temporary = above / "temporary"
        self.stage.temporary.mkdir()
        self._operations = operations_of(self.stage)
        self._moves = [i for i, name in enumerate(self._operations) if name in _MOVES]
        self.stage.reset()
        self._seconds = seconds_of(lambda: code_of(self.stage.start_new()))
        staging = staging_folder(self.stage.out, "fire").path
        self._folder = {"build": self.stage.out, "staging": staging, "recipe": project}[kind]
        self._away = above / "away"
        self._theirs = above / "theirs"
        self._files = {name: f"mine: {name}".encode() for name in self._names(kind)}
        _write(self._theirs, self._files)
        self._before = _contents(self._theirs)

    def _names(self, kind: str) -> list[str]:
        """Return the paths of what may be in the folder."""
        outputs = sorted(self.stage.old.keys() | self.stage.new.keys())
        match kind:
            case "build":
                return outputs
            case "staging":
                return [*outputs, *(f".previous/{name}" for name in outputs)]
            case _:
                inputs = ["fire.yaml", "other.yaml", "shared.j2"]
                frames = [f"clip/{path.name}" for path in (self._folder / "clip").iterdir()]
                return [*inputs, *frames, *(f"build/{name}" for name in outputs)]

    def try_(self, number: int, chance: random.Random) -> list[str]:
        """Exchange the folder during one build, and build once more; return what is wrong."""
        self.stage.reset()
        if number % 2:
            chosen_from = self._moves if number % 4 == 3 else range(len(self._operations))
            at = chance.choice(chosen_from)
            meet = partial(self._exchange_at, at)
            pid = self.stage.start_new(before=Operations(self.stage.out, meet).go)
            when = f"before operation {at} ({self._operations[at]})"
        else:
            instant = chance.uniform(0, self._seconds)
            pid = self.stage.start_new()
            time.sleep(instant)
            self._exchange()
            when = f"{instant:.4f} s into the build"
        found = self._faults_after("the build", pid)
        found += self._faults_after("the next build", self.stage.start_new())
        self._put_back()
        return [f"{when}: {fault}" for fault in found]

    def _exchange_at(self, at: int, number: int, _: str) -> None:
        if number == at:
            self._exchange()

    def _exchange(self) -> None:
        """Put the link in the place of the folder, or where that would be."""
        with suppress(FileNotFoundError):
            self._folder.rename(self._away)
        with suppress(FileExistsError, FileNotFoundError):  # the build was faster
            self._folder.symlink_to(self._theirs)

    def _faults_after(self, who: str, pid: int) -> list[str]:
        code, now = code_of(pid), _contents(self._theirs)
        said = self.stage.said.read_text()
        kinds = {
            "removed": self._before.keys() - now.keys(),
            "added": now.keys() - self._before.keys(),
            "replaced": {name for name in now if self._before.get(name, now[name]) != now[name]},
        }
        faults = [
            f"{who} (code {code}) has {kind} {len(names)} of the user's: {sorted(names)[:4]}"
            for kind, names in kinds.items()
            if names
        ]
        if is_careless(said) or code not in {0, 1, 2}:
            faults.append(f"{who} ended with code {code}: {said}")
        if faults:
            shutil.rmtree(self._theirs)
            _write(self._theirs, self._files)
        return faults

    def _put_back(self) -> None:
        """Undo the exchange, as far as there was one."""
        if self._folder.is_symlink():
            self._folder.unlink()
        if self._away.exists():
            shutil.rmtree(self._folder, ignore_errors=True)
            self._away.rename(self._folder)
        if not self.stage.out.exists():
            self.stage.out.mkdir()


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def _contents(folder: Path) -> dict[str, bytes]:
    """Return every file in a folder, and folders as files without bytes, by their paths."""
    return {
        str(path.relative_to(folder)): b"" if path.is_dir() else path.read_bytes()
        for path in folder.rglob("*")
    }
