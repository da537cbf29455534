"""The file operations of a process in one folder, one by one, with something done before each."""

import builtins
import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.campaign.forks import code_of
from tests.campaign.stage import Stage

_NAMES = (
    "open", "mkdir", "rmdir", "unlink", "replace", "rename", "link", "fsync", "scandir", "write",
    "ftruncate",
)  # fmt: skip
"""Of the module ``os``; opening files as ``pathlib`` does is one more."""

_BELOW = ("dir_fd", "src_dir_fd")
"""Arguments of these functions that name the folder from which a path leads on."""


class Operations:
    """Counts the file operations of this process that are about a folder."""

    def __init__(self, folder: Path, meet: Callable[[int, str], None]) -> None:
        """Call ``meet`` before each with its number, from 0, and its name."""
        self._folder, self._meet = folder, meet
        self._count = 0

    def go(self) -> None:
        """Begin to count."""
        for name in _NAMES:
            setattr(os, name, self._wrapped(name, getattr(os, name)))
        io.open = builtins.open = self._wrapped("io.open", io.open)

    def _wrapped(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def operation(*arguments: Any, **keys: Any) -> Any:
            if self._concerns(arguments, keys):
                self._count += 1
                self._meet(self._count - 1, name)
            return call(*arguments, **keys)

        return operation

    def _concerns(self, arguments: tuple[Any, ...], keys: dict[str, Any]) -> bool:
        """Return whether an operation is about the folder; descriptors are looked up."""
        below = next((keys[key] for key in _BELOW if keys.get(key) is not None), None)
        try:
            path = whole_path(arguments[0] if arguments else "", below)
        except (OSError, TypeError):
            return False
        return str(path).startswith(str(self._folder))


def whole_path(about: Any, below: int | None = None) -> Path:
    """Return the path of what a function of ``os`` is about: a path, which may begin at an open
    folder, or something open."""
    if isinstance(about, int):
        return Path(f"/proc/self/fd/{about}").readlink()
    return Path(os.fspath(about)) if below is None else whole_path(below) / about


def operations_of(stage: Stage) -> list[str]:
    """Return the name of each file operation of a build over the older one, in order."""
    report, write = stage.folder / "operations", os.write
    descriptor = os.open(report, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)

    def meet(_: int, name: str) -> None:
        write(descriptor, f"{name}\n".encode())

    stage.reset()
    code = code_of(stage.start_new(before=Operations(stage.out, meet).go))
    os.close(descriptor)
    assert code == 0, stage.said.read_text()
    return report.read_text().split()
