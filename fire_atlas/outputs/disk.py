"""File operations of builds: writes that survive a power cut, and errors that give advice."""

import errno
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.digest import file_digest

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


@contextmanager
def readable_errors(path: Path) -> Iterator[None]:
    """Turn the operating system's errors about ``path`` into an OutputError that gives advice."""
    try:
        yield
    except PermissionError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror}); choose another folder with -o, or "
            f"change its permissions"
        ) from error
    except (FileExistsError, NotADirectoryError) as error:
        raise OutputError(f"{path}: a file is in the way of the output folder") from error
    except OSError as error:
        if error.errno in _FULL:
            raise OutputError(
                f"{path}: the disk is full ({error.strerror}); the previous outputs are unchanged. "
                f"Free some space, or choose another folder with -o"
            ) from error
        raise OutputError(f"{path}: cannot be written ({error.strerror})") from error


def write_synced(path: Path, data: bytes) -> None:
    """Write a file and wait until its bytes are on the disk."""
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def digest_of(path: Path) -> str | None:
    """Return the SHA-256 of a file, None if nothing is there, "" for a folder or a link."""
    if is_regular(path):
        return file_digest(path)
    return "" if path.is_symlink() or path.exists() else None


def is_regular(path: Path) -> bool:
    """Return whether ``path`` is a file, and not a link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def link_or_copy(path: Path, to: Path) -> None:
    """Make ``to`` a hard link to the file ``path``, or a copy where there are no hard links."""
    try:
        to.hardlink_to(path)
    except OSError:  # not every file system has hard links
        shutil.copy2(path, to)
        with to.open("rb+") as file:
            os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Wait until the file names in a folder are on the disk, if the system can do that."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in {errno.EINVAL, errno.EOPNOTSUPP}:
            raise
    finally:
        os.close(descriptor)
