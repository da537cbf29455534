"""Open and read input files safely, and sort numbered ones.

Every input file is opened here. Only regular files are: opening a named pipe waits until another
process writes into it, and a device may never end.
"""

import errno
import io
import os
import re
import stat
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

MIB = 1 << 20

MAX_JSON_BYTES = 64 * MIB
"""Limit on the size of the JSON of an atlas or a profile: to read more values than fit into that
takes over 500 MB and seconds (64 MiB of zeros: 0.4 GB, 2 s; Python 3.11, November 2026)."""


def open_file(path: Path) -> io.BufferedReader:
    """Open a regular file, or a link to one, for reading.

    Raises:
        OSError: It is missing, cannot be read, or is a folder, pipe, device or socket; ``strerror``
            says which.
    """
    file = open(path, "rb", opener=_open_without_waiting)  # noqa: SIM115 - the caller closes it
    mode = os.fstat(file.fileno()).st_mode
    if not stat.S_ISREG(mode):
        file.close()
        kind = "a named pipe" if stat.S_ISFIFO(mode) else "a device"
        raise OSError(errno.EINVAL, f"is {kind}, not a file", str(path))
    return file


def read_file(path: Path, max_bytes: int) -> bytes:
    """Return the content of a regular file of at most ``max_bytes`` bytes.

    Raises:
        OSError: As for ``open_file``, or the file is larger.
    """
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        data = b"" if size > max_bytes else file.read(size + 1)
        if len(data) > size:  # it grows while it is read
            data += file.read(max_bytes + 1 - len(data))
    if max(size, len(data)) > max_bytes:
        raise OSError(errno.EFBIG, f"is larger than {max_bytes / MIB:g} MiB", str(path))
    return data


def _open_without_waiting(path: str, flags: int) -> int:
    """Open a file; do not wait for the other end if it is a named pipe."""
    mode = os.stat(path).st_mode  # noqa: PTH116 - an opener gets the path as a string
    if stat.S_ISSOCK(mode):
        raise OSError(errno.EINVAL, "is a socket, not a file", path)
    if stat.S_ISDIR(mode):
        raise OSError(errno.EISDIR, "is a folder, not a file", path)
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def absolute(path: Path) -> Path:
    """Return an absolute path without ``..``; links stay as they are named."""
    return Path(os.path.abspath(path))  # noqa: PTH100 - ``resolve`` follows links


def real(path: Path) -> Path:
    """Return an absolute path without links; one that leads in a circle stays as it is."""
    return Path(os.path.realpath(path))  # ``Path.resolve`` fails there


def links_to(path: Path) -> Iterator[Path]:
    """Yield the links on the way that ``path`` names, to a file, a folder or nothing: each as an
    absolute path whose folder is named without links."""
    met, way = set[Path](), absolute(path)
    while link := next((p for p in (*reversed(way.parents), way) if p.is_symlink()), None):
        place = real(link.parent) / link.name
        if place in met:  # it leads in a circle
            return
        met.add(place)
        yield place
        way = absolute(link.parent / link.readlink() / way.relative_to(link))


def natural_key(path: Path, *, minus: int | None = None) -> tuple[object, ...]:
    """Return a sort key by which fire2 comes before fire10, whatever the machine and its locale.

    ``minus``: where in the stem stands a minus, right before a number; None if nowhere.
    """
    words = [_words(name) for name in path.parts[:-1]]
    if minus is None:
        words.append(_words(path.stem))
    else:
        _, (number, _), *after = _words(path.stem[minus + 1 :])
        words.append((*_words(path.stem[:minus]), (-number, ""), *after))
    return (words, path.suffix.casefold(), str(path))


@lru_cache(maxsize=4096)  # the folders of all frames are the same
def _words(name: str) -> tuple[tuple[int, str], ...]:
    """Return a name as texts and numbers in turn, from text to text, to be compared with others."""
    parts = re.split(r"([0-9]+)", name.casefold())
    return tuple((int(part), "") if i % 2 else (-1, part) for i, part in enumerate(parts))
