"""One fault at every file operation of a build: the process is killed there, or the system says
that the disk is full, that it is not allowed, or that the device failed."""

import builtins
import errno
import io
import os
import random
import signal
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.campaign.stage import NEW, NEXT, Stage, code_of

FAULTS = ("KILL", "ENOSPC", "EACCES", "EIO")

_OPERATIONS = (
    "open", "mkdir", "rmdir", "unlink", "replace", "link", "fsync", "scandir", "write", "ftruncate",
)  # fmt: skip
"""Of the module ``os``; opening files as ``pathlib`` does is one more."""


def run(count: int | None, seed: int) -> list[str]:
    """Try every fault at every operation, or ``count`` of them drawn by chance."""
    chance, faults = random.Random(seed), list[str]()
    with tempfile.TemporaryDirectory() as folder:
        stage = Stage(Path(folder))
        operations = _operations_of(stage)
        tries = [(k, fault) for k in range(len(operations)) for fault in FAULTS]
        chosen = tries if count is None else chance.sample(tries, min(count, len(tries)))
        for k, fault in chosen:
            stage.reset()
            code = code_of(stage.start("build", *NEW, before=_Faulty(stage, k, fault).go))
            found = stage.faults_after_death()
            if code >= 0:  # it could still put things right
                found += stage.faults_after(stage.old, stage.new, litter=True)
            command = chance.choice(NEXT)
            found += stage.then(command)
            if command in {"check", "clean"}:
                found += stage.then("build new")
            where = f"{fault} at operation {k} ({operations[k]}), then {command}"
            faults += [f"{where}: {each}" for each in found]
    print(f"{len(operations)} operations, {len(chosen)} faults tried")
    return faults


def _operations_of(stage: Stage) -> list[str]:
    """Return the name of each file operation of a build, in order."""
    report = stage.folder / "operations"
    stage.reset()
    code = code_of(stage.start("build", *NEW, before=_Faulty(stage, -1, "", report).go))
    assert code == 0
    return report.read_text().split()


class _Faulty:
    """Counts the file operations of this process, and lets one of them fail."""

    def __init__(self, stage: Stage, at: int, fault: str, report: Path | None = None) -> None:
        self.stage, self.at, self.fault = stage, at, fault
        self.report = -1 if report is None else os.open(report, os.O_WRONLY | os.O_CREAT)
        self.count = 0
        self.write = os.write

    def go(self) -> None:
        """Begin to count."""
        for name in _OPERATIONS:
            setattr(os, name, self._wrapped(name, getattr(os, name)))
        opened = self._wrapped("io.open", io.open)
        io.open = builtins.open = opened

    def _wrapped(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def operation(*arguments: Any, **keys: Any) -> Any:
            if self._concerns(arguments):
                self._meet(name)
            return call(*arguments, **keys)

        return operation

    def _concerns(self, arguments: tuple[Any, ...]) -> bool:
        """Whether an operation is about the output folder; descriptors are looked up."""
        about = arguments[0] if arguments else None
        try:
            descriptor = Path(f"/proc/self/fd/{about}")
            path = descriptor.readlink() if isinstance(about, int) else os.fspath(about or "")
        except (OSError, TypeError):
            return False
        return str(path).startswith(str(self.stage.out))

    def _meet(self, name: str) -> None:
        if self.report >= 0:
            self.write(self.report, f"{name}\n".encode())
        self.count += 1
        if self.count - 1 != self.at:
            return
        if self.fault == "KILL":
            os.kill(os.getpid(), signal.SIGKILL)
        number = getattr(errno, self.fault)
        raise OSError(number, os.strerror(number))
