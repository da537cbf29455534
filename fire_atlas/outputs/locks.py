"""Locks between processes: one build of a recipe at a time, and one commit into a folder.

The system releases the locks of a process that dies. A build that ends removes its lock file.
"""

import errno
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.core.interruption import if_interrupted, signals_wait

if TYPE_CHECKING:
    from filelock import BaseFileLock

_NOT_SUPPORTED = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP}
_INTERVAL = 0.05
"""Seconds between two attempts to take a lock."""

_SHORT_WAIT = 0.3
"""Seconds of waiting that are not worth a note: recipes built side by side commit in turns."""


def folder_lock(out: Path) -> Path:
    """Return the lock file for commits into ``out``."""
    return out / ".fire-atlas.lock"


def recipe_lock(out: Path, name: str) -> Path:
    """Return the lock file for builds of ``name`` into ``out``."""
    return out / f".fire-atlas-{name}.lock"


@contextmanager
def locked(path: Path, note: Callable[[str], None]) -> Iterator[None]:
    """Hold the lock file ``path``, waiting for it if need be.

    Args:
        path: The lock file. Its folder is made again if a build that failed has removed it.
        note: Called with a sentence if another process is waited for longer than a commit takes,
            or if the file system has no locks.
    """
    is_noted, began = False, time.monotonic()
    with _released(path) as lock:
        try:
            while not _try_to_take(lock, path):
                if not is_noted and time.monotonic() - began > _SHORT_WAIT:
                    note(f"waits for {_holder(path)}, which writes into {path.parent} too")
                    is_noted = True
                time.sleep(_INTERVAL)
        except OSError as error:
            if error.errno not in _NOT_SUPPORTED:
                raise
            path.unlink(missing_ok=True)
            note(f"{path.parent}: no locks on this file system; build into it one at a time")
        yield


@contextmanager
def locked_if_free(path: Path) -> Iterator[bool]:
    """Hold the lock file ``path`` unless another process does; yield whether it is held."""
    with _released(path) as lock:
        try:
            is_held = _try_to_take(lock, path)
        except OSError:
            is_held = False
        yield is_held


def _try_to_take(lock: "BaseFileLock", path: Path) -> bool:
    """Try once to take a lock; return whether that succeeded."""
    from filelock import Timeout

    path.parent.mkdir(parents=True, exist_ok=True)
    with suppress(OSError):
        if path.lstat().st_nlink > 1:  # another name of a user's file, which must not be emptied
            path.unlink()
    try:
        with signals_wait():  # a file is either there and held, or not there
            lock.acquire(timeout=0)
    except (Timeout, FileNotFoundError):
        return False
    return True


@contextmanager
def _released(path: Path) -> Iterator["BaseFileLock"]:
    """Yield a lock of the file ``path``, not yet taken. If it is taken it is released at the end,
    and its file removed, also if a signal ends the process."""
    from filelock import FileLock  # commands that write nothing do not import it

    lock = FileLock(path, fallback_to_soft=False, on_acquired=_write_holder)

    def remove() -> None:
        if lock.is_locked:
            with suppress(OSError):  # Windows cannot remove open files; the next build does
                path.unlink()

    with if_interrupted(remove):
        try:
            yield lock
        finally:
            with signals_wait():
                remove()
                lock.release()


def _write_holder(descriptor: int) -> None:
    from platform import node

    with suppress(OSError):  # on a full disk the file stays empty
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"process {os.getpid()} on {node()}".encode())


def _holder(path: Path) -> str:
    """Return a description of the process that holds a lock."""
    try:
        return path.read_text(encoding="utf-8") or "another build"
    except OSError:
        return "another build"
