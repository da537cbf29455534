"""Input files: how they are opened and read, and the order of numbered ones.

Only regular files are opened, and none is read beyond a bound.

Opening a named pipe waits until another process writes into it, and a device may have no end:
neither is ever what a user meant to give. All files from outside are opened here.
"""

import errno
import io
import os
import re
import stat
from pathlib import Path

MIB = 1 << 20

MAX_JSON_BYTES = 256 * MIB
"""Largest JSON file that is read: an atlas, tracks, a manifest, a profile."""


def open_file(path: Path) -> io.BufferedReader:
    """Open a regular file, or what a link to one leads to, for reading.

    Raises:
        OSError: It is missing, cannot be read, or is a folder, pipe, device or socket; ``strerror``
            says which.
    """
    file = open(path, "rb", opener=_open_at_once)  # noqa: SIM115 - the caller closes it
    mode = os.fstat(file.fileno()).st_mode
    if not stat.S_ISREG(mode):
        file.close()
        kind = "a named pipe" if stat.S_ISFIFO(mode) else "a device"
        raise OSError(errno.EINVAL, f"is {kind}, not a file", str(path))
    return file


def read_file(path: Path, most: int) -> bytes:
    """Return the content of a regular file of at most ``most`` bytes.

    Raises:
        OSError: As for ``open_file``, or the file is larger.
    """
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        data = file.read(min(size, most) + 1)
        if len(data) > size:  # it grows while it is read
            data += file.read(most + 1 - len(data))
    if len(data) > most:
        raise OSError(errno.EFBIG, f"is larger than {most / MIB:g} MiB", str(path))
    return data


def _open_at_once(path: str, flags: int) -> int:
    """Open without waiting for the other end of a pipe."""
    mode = os.stat(path).st_mode  # noqa: PTH116 - an opener is given text
    if stat.S_ISSOCK(mode):
        raise OSError(errno.EINVAL, "is a socket, not a file", path)
    if stat.S_ISDIR(mode):
        raise OSError(errno.EISDIR, "is a folder, not a file", path)
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def natural_key(path: Path) -> tuple[object, ...]:
    """Return the sort key that puts fire2 before fire10, on every machine and in every locale."""
    parts = [re.split(r"([0-9]+)", part.casefold()) for part in path.parts]
    words = tuple(
        tuple((int(w), "") if w.isascii() and w.isdigit() else (-1, w) for w in part)
        for part in parts
    )
    return (words, str(path))
