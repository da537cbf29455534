"""A power cut at every file operation of a build: what was not synced is lost, in whole or in part.

The operations of one build are recorded. The folder is rebuilt as a disk may hold it after each of
them: names that were not synced are all lost, all kept, or lost by chance one by one; bytes that
were not synced are lost. Then the next command runs there.
"""

import base64
import builtins
import io
import json
import os
import random
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.campaign.forks import code_of
from tests.campaign.operations import whole_path
from tests.campaign.rows import chosen, run_rows
from tests.campaign.stage import Stage

_KEPT = {"half is lost": 0.5, "all is lost": 0.0, "all is kept": 1.0}
"""Share of the names that were not synced which are kept, by the name of the row."""


@dataclass(frozen=True, slots=True)
class Operation:
    """One change of the output folder.

    Attributes:
        kind: ``create``, ``mkdir``, ``link``, ``replace``, ``unlink``, ``rmdir`` or ``sync``.
        path: What it is about, relative to the folder.
        to: The second path of ``link`` and ``replace``.
        data: The bytes that ``sync`` of a file brings to the disk.
    """

    kind: str
    path: str
    to: str = ""
    data: bytes = b""

    @property
    def folders(self) -> set[str]:
        """The folders whose names it changes."""
        return {os.path.dirname(path) for path in (self.path, self.to or self.path)}  # noqa: PTH120


def run(count: int | None, seed: int) -> list[str]:
    """Cut the power after every operation, or after ``count`` of them drawn by chance; where half
    is lost, which differs, twice."""
    with tempfile.TemporaryDirectory() as folder:
        cuts = len(_recorded(Stage(Path(folder)))) + 1
    print(f"{cuts - 1} operations")
    tries = {kind: 2 * cuts if share == 0.5 else cuts for kind, share in _KEPT.items()}
    return run_rows(cut, chosen(tries, count, seed), seed)


def cut(kind: str, numbers: Sequence[int], seed: int) -> list[list[str]]:
    """Cut the power, with as many operations done as each number says; return what was wrong."""
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(Path(folder))
        operations = _recorded(stage)
        results = []
        for number in numbers:
            end = number % (len(operations) + 1)
            chance = random.Random(f"{seed} {number}")
            _cut(stage, operations[:end], _KEPT[kind], chance)
            found = stage.then("check") + stage.then("build new")
            results.append([f"after {end} operations: {each}" for each in found])
        return results


def _cut(stage: Stage, done: Sequence[Operation], share: float, chance: random.Random) -> None:
    """Make the folder what the disk may hold after the operations that were ``done``."""
    disk = _Disk.of(stage.shelf)
    for i, operation in enumerate(done):
        synced = {each.path for each in done[i:] if each.kind == "sync"}
        if operation.kind == "sync" or synced & operation.folders or chance.random() < share:
            disk.apply(operation)
    disk.write(stage.out)


@dataclass(slots=True)
class _Disk:
    """Folders, and files by their names; several names may be those of one file."""

    folders: set[str] = field(default_factory=lambda: {""})
    files: dict[str, list[bytes]] = field(default_factory=dict)

    @classmethod
    def of(cls, folder: Path) -> "_Disk":
        return cls(files={path.name: [path.read_bytes()] for path in folder.iterdir()})

    def apply(self, operation: Operation) -> None:
        """Do it, as far as what it is about is there."""
        path, to = operation.path, operation.to
        match operation.kind:
            case "mkdir" if self._has_folder(path):
                self.folders.add(path)
            case "create" if self._has_folder(path):
                self.files[path] = [b""]
            case "sync" if path in self.files:
                self.files[path][0] = operation.data
            case "link" if path in self.files and self._has_folder(to):
                self.files[to] = self.files[path]
            case "replace" if path in self.files and self._has_folder(to):
                self.files[to] = self.files.pop(path)
            case "unlink":
                self.files.pop(path, None)
            case "rmdir":
                self.folders.discard(path)

    def _has_folder(self, path: str) -> bool:
        return os.path.dirname(path) in self.folders  # noqa: PTH120

    def write(self, out: Path) -> None:
        shutil.rmtree(out)
        for folder in sorted(self.folders):
            (out / folder).mkdir(parents=True, exist_ok=True)
        for name, data in self.files.items():
            if self._has_folder(name):
                (out / name).write_bytes(data[0])


def _recorded(stage: Stage) -> list[Operation]:
    """Return the operations of a build over an older one."""
    report = stage.folder / "operations"
    stage.reset()
    assert code_of(stage.start_new(before=_Recorder(stage.out, report).go)) == 0
    return list(_read(report))


def _read(report: Path) -> Iterator[Operation]:
    for line in report.read_text().splitlines():
        kind, path, to, data = json.loads(line)
        yield Operation(kind, path, to, base64.b64decode(data))


class _Recorder:
    """Writes down what this process does in a folder."""

    def __init__(self, out: Path, report: Path) -> None:
        self.out = out
        self.report = os.open(report, os.O_WRONLY | os.O_CREAT)
        self.read = io.open

    def go(self) -> None:
        """Begin to record."""
        for name in ("mkdir", "link", "replace", "unlink", "rmdir"):
            setattr(os, name, self._named(name, getattr(os, name)))
        os.fsync = self._synced(os.fsync)
        os.open = self._opened(os.open, lambda flags: flags & os.O_CREAT)
        io.open = builtins.open = self._opened(io.open, lambda mode: "w" in mode)

    def _named(self, kind: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def operation(*paths: Any, **keys: Any) -> Any:
            below = keys.get("dir_fd", keys.get("src_dir_fd")), keys.get("dst_dir_fd")
            named = [each for each in paths if not isinstance(each, int)]
            whole = map(str, map(whole_path, named, below))
            path, to, *_ = [*whole, ""]
            result = call(*paths, **keys)
            self._tell(kind, path, to)
            return result

        return operation

    def _opened(
        self, call: Callable[..., Any], creates: Callable[[Any], Any]
    ) -> Callable[..., Any]:
        def operation(path: Any, how: Any = "r", *arguments: Any, **keys: Any) -> Any:
            whole = whole_path(path, keys.get("dir_fd"))
            is_new = not isinstance(path, int) and creates(how) and not whole.exists()
            result = call(path, how, *arguments, **keys)
            if is_new:
                self._tell("create", str(whole))
            return result

        return operation

    def _synced(self, call: Callable[[Any], None]) -> Any:
        def operation(descriptor: Any) -> None:
            call(descriptor)
            path = whole_path(descriptor)
            data = b"" if path.is_dir() else self.read(path, "rb").read()
            self._tell("sync", str(path), data=data)

        return operation

    def _tell(self, kind: str, path: str, to: str = "", data: bytes = b"") -> None:
        if not path.startswith(str(self.out)):
            return
        inside = [os.path.relpath(each, self.out) if each else "" for each in (path, to)]
        names = ["" if each == "." else each for each in inside]
        line = json.dumps([kind, *names, base64.b64encode(data).decode()])
        os.write(self.report, f"{line}\n".encode())
