"""``watch`` while links to what it reads are pointed elsewhere, and their targets change.

A link is the recipe, the recipe that it extends, the folder of its frames, or one frame. Wrong is,
some seconds after each change, any output that differs from what ``build`` would write now or,
where that would fail, from what was there before.
"""

import json
import os
import random
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from PIL import Image

from tests.campaign import corpus
from tests.campaign.forks import code_of, fork, is_careless
from tests.campaign.rows import chosen, run_rows

_LINKS = {"recipe": "fire.yaml", "base": "base.yaml", "folder": "clip", "frame": "clip/0001.png"}
"""What is a link, by the name of the row."""

_TRIES = dict.fromkeys(_LINKS, 15)
"""Tries of a whole campaign; one ``watch`` serves all of a row."""

_SECONDS = 15
"""Far more than a change takes to be seen and built, on a busy machine too."""

_QUIET = 1.0
"""For so many seconds outputs have to stay as they are where a build would fail."""

_LONGEST = 1200
"""Seconds after which ``watch`` ends if nobody ends it."""


def run(count: int | None, seed: int) -> list[str]:
    """Try ``count`` changes drawn by chance, or all."""
    return run_rows(watched, chosen(_TRIES, count, seed), seed)


def watched(kind: str, numbers: Sequence[int], seed: int) -> list[list[str]]:
    """Make changes while ``watch`` runs; return what was wrong after each."""
    with tempfile.TemporaryDirectory(prefix="watch-") as folder:
        scene = _Scene(Path(folder), kind)
        try:
            return [scene.try_(n, random.Random(f"{seed} {kind} {n}")) for n in numbers]
        finally:
            scene.end()


class _Scene:
    """A folder in which ``watch`` runs, and one thing that it reads is a link.

    Each target that the link may lead to, and each change of one, makes other outputs.
    """

    def __init__(self, folder: Path, kind: str) -> None:
        self._kind = kind
        self._out, self._fresh = folder / "build", folder / "fresh"
        self._said, self._temporary = folder / "said", folder / "temporary"
        self._targets = folder / "targets"
        self._recipe, self._link = folder / "fire.yaml", folder / _LINKS[kind]
        self._count = 0
        for path in (self._temporary, self._targets):
            path.mkdir()
        corpus.write_clip(folder / "clip")
        (folder / "base.yaml").write_text("seed: 1\n")
        self._recipe.write_text(_recipe_of(folder, 1))
        _remove(self._link)
        self._link.symlink_to(self._made())
        line = ["watch", str(self._recipe), "-q"]
        self._watch = fork(line, self._said, self._temporary, _run_on)
        self._last: dict[str, bytes] = {}
        assert self._faults() == [], self._said.read_text()

    def end(self) -> None:
        """End ``watch``."""
        os.kill(self._watch, signal.SIGKILL)
        code_of(self._watch)

    def try_(self, number: int, chance: random.Random) -> list[str]:
        """Make a change, which may have several parts; return what is wrong after each part."""
        changes = [
            self._point_by_rename, self._point_by_removal, self._write_in_place, self._replace,
            self._remove_and_make, self._point_at_nothing, self._point_back, self._change_twice,
        ]  # fmt: skip
        change = changes[number % len(changes)]
        found = []
        for part in change(chance):
            found += [f"{change.__name__[1:]}, {part}: {fault}" for fault in self._faults()]
        return found

    # The changes. Each yields after every part of it, with what that was.

    def _point_by_rename(self, _: random.Random) -> Iterator[str]:
        self._point(self._made())
        yield "pointed elsewhere"

    def _point_by_removal(self, _: random.Random) -> Iterator[str]:
        """As ``ln -sfn`` does."""
        target = self._made()
        self._link.unlink()
        self._link.symlink_to(target)
        yield "pointed elsewhere"

    def _write_in_place(self, _: random.Random) -> Iterator[str]:
        self._write(self._target)
        yield "written"

    def _replace(self, _: random.Random) -> Iterator[str]:
        """As editors and checkouts do."""
        new, target = self._made(), self._target
        target.rename(target.with_name("old"))
        new.rename(target)
        _remove(target.with_name("old"))
        yield "replaced"

    def _remove_and_make(self, _: random.Random) -> Iterator[str]:
        target = self._target
        _remove(target)
        yield "removed"
        self._write(target)
        yield "made again"

    def _point_at_nothing(self, _: random.Random) -> Iterator[str]:
        target = self._made()
        away = target.rename(target.with_name("away"))
        self._point(target)
        yield "pointed at nothing"
        away.rename(target)
        yield "made"

    def _point_back(self, chance: random.Random) -> Iterator[str]:
        """To any target that there is, through a link of another link's."""
        middle = self._targets / f"link{self._count}"
        target = chance.choice([p for p in sorted(self._targets.iterdir()) if not p.is_symlink()])
        middle.symlink_to(target)
        self._point(middle)
        yield "pointed at a link"
        _remove(middle)
        middle.symlink_to(self._made())
        yield "that link pointed elsewhere"

    def _change_twice(self, chance: random.Random) -> Iterator[str]:
        self._point(self._made())
        time.sleep(chance.uniform(0, 0.3))
        self._write(self._target)
        yield "pointed elsewhere and written"

    @property
    def _target(self) -> Path:
        return self._link.resolve()

    def _point(self, target: Path) -> None:
        """Point the link elsewhere at once."""
        new = self._link.with_name(".new link")
        new.symlink_to(target)
        new.replace(self._link)

    def _made(self) -> Path:
        """Make another target; return it."""
        target = self._targets / f"{self._count}{self._link.suffix}"
        self._write(target)
        return target

    def _write(self, target: Path) -> None:
        """Write a target that there has not been yet."""
        self._count += 1
        match self._kind:
            case "recipe":
                target.write_text(_recipe_of(self._recipe.parent, self._count))
            case "base":
                target.write_text(f"seed: {self._count}\n")
            case "folder":
                target.mkdir(exist_ok=True)
                for i in range(3):
                    _write_frame(target / f"{i:04}.png", i + self._count)
            case _:
                _write_frame(target, self._count)

    def _faults(self) -> list[str]:
        """Wait until outputs are as they have to be; return what is wrong if they never are."""
        line = ["build", str(self._recipe), "-o", str(self._fresh), "--force", "-q"]
        code = code_of(fork(line, self._fresh.with_name("fresh said"), self._temporary))
        faults = []
        if code:
            time.sleep(_QUIET)
            if _shown(self._out) != self._last:
                faults.append("outputs changed where a build fails")
        else:
            due, latest = _shown(self._fresh), time.monotonic() + _SECONDS
            while (now := _shown(self._out)) != due and time.monotonic() < latest:
                time.sleep(0.05)
            if now != due:
                differing = sorted(n for n in due.keys() | now.keys() if due.get(n) != now.get(n))
                faults.append(f"after {_SECONDS} s, not what a build writes: {differing}")
        self._last = _shown(self._out)
        if is_careless(self._said.read_text()):
            faults.append(f"watch has not thought of this: {self._said.read_text()}")
        return faults


def _run_on() -> None:
    signal.alarm(_LONGEST)


def _recipe_of(folder: Path, seed: int) -> str:
    keys = {
        "extends": str(folder / "base.yaml"), "source": {"path": str(folder / "clip")},
        "flakes": {"rate": 30, "alpha": 0.01}, "exports": ["json"],
    }  # fmt: skip
    return json.dumps(keys | ({"seed": seed} if seed > 1 else {}))


def _write_frame(path: Path, number: int) -> None:
    frame = corpus.flames(1)[0]
    frame[2:5, 2:5] = 255 - 5 * (number % 40), number % 200, 9, 255
    Image.fromarray(frame).save(path, "PNG")


def _shown(folder: Path) -> dict[str, bytes]:
    """Return the files in a folder but for hidden ones; none while it is being changed."""
    try:
        return {path.name: path.read_bytes() for path in folder.iterdir() if path.name[0] != "."}
    except FileNotFoundError:
        return {}


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()
