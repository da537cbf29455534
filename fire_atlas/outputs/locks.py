"""Locks between processes: one build of a recipe at a time, and one commit into a folder.

The system drops the lock of a process that dies. A build that ends removes its lock file.
"""

import errno
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.core.interruption import if_interrupted

if TYPE_CHECKING:
    from filelock import BaseFileLock

_NOT_SUPPORTED = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP}
_INTERVAL = 0.05
"""Seconds between two looks whether a lock is free."""


def folder_lock(out: Path) -> Path:
    """Return the lock file of all commits into ``out``."""
    return out / ".fire-atlas.lock"


def recipe_lock(out: Path, name: str) -> Path:
    """Return the lock file of the builds called ``name`` into ``out``."""
    return out / f".fire-atlas-{name}.lock"


@contextmanager
def locked(path: Path, note: Callable[[str], None]) -> Iterator[None]:
    """Hold the lock file ``path``, waiting for it if need be.

    Args:
        path: Its folder is made again where another build, which failed, has removed it.
        note: Called with a sentence that names the process waited for, or that says that the file
            system has no locks.
    """
    lock = _lock(path)
    is_noted = False
    try:
        while not _is_taken(lock, path):
            if not is_noted:
                note(f"waits for {_holder(path)}, which writes into {path.parent} too")
            is_noted = True
            time.sleep(_INTERVAL)
    except OSError as error:
        if error.errno not in _NOT_SUPPORTED:
            raise
        path.unlink(missing_ok=True)
        note(f"{path.parent}: no locks on this file system; build into it one at a time")
    with _released(lock, path), if_interrupted(partial(path.unlink, missing_ok=True)):
        yield


@contextmanager
def locked_if_free(path: Path) -> Iterator[bool]:
    """Hold the lock file ``path`` if no other process does; yield whether it is held."""
    lock = _lock(path)
    try:
        is_taken = _is_taken(lock, path)
    except OSError:
        is_taken = False
    with _released(lock, path):
        yield is_taken


def _lock(path: Path) -> "BaseFileLock":
    from filelock import FileLock  # commands that write nothing do not import it

    return FileLock(path, fallback_to_soft=False, on_acquired=_write_holder)


def _is_taken(lock: "BaseFileLock", path: Path) -> bool:
    """Try to take a lock once; return whether that worked."""
    from filelock import Timeout

    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        lock.acquire(timeout=0)
    except (Timeout, FileNotFoundError):
        return False
    return True


@contextmanager
def _released(lock: "BaseFileLock", path: Path) -> Iterator[None]:
    """Give a lock back at the end, if it was taken at all."""
    try:
        yield
    finally:
        if lock.is_locked:
            with suppress(OSError):  # Windows removes no open file; there, the next one does
                path.unlink()
            lock.release()


def _write_holder(descriptor: int) -> None:
    from platform import node

    with suppress(OSError):  # on a full disk the file stays empty
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"process {os.getpid()} on {node()}".encode())


def _holder(path: Path) -> str:
    """Return the name of the process that holds a lock, for a person."""
    try:
        return path.read_text(encoding="utf-8") or "another build"
    except OSError:
        return "another build"
