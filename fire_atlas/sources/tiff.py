"""TIFF files as tags: what their first picture is like, read without decoding a pixel.

Pillow names no size for kinds of pixels that it does not know, floats in colour among them.
"""

import struct
from typing import BinaryIO

WIDTH, HEIGHT, BITS, EXTRA_SAMPLES = 256, 257, 258, 338
"""Numbers of tags."""

_FORMATS = {1: "B", 3: "H", 4: "I"}
"""Letters of ``struct`` for the types of whole numbers."""

_MOST_VALUES = 64
"""More values than any of these tags has."""


def read_tags(file: BinaryIO) -> dict[int, tuple[int, ...]]:
    """Return the whole numbers of the first picture's tags, by tag.

    Raises:
        struct.error: The file ends early.
    """
    head = file.read(8)
    order = "<" if head[:2] == b"II" else ">"
    (start,) = struct.unpack_from(f"{order}I", head, 4)
    file.seek(start)
    (count,) = struct.unpack(f"{order}H", file.read(2))
    entries = file.read(12 * count)
    tags = {}
    for at in range(0, 12 * count, 12):
        tag, kind, length = struct.unpack_from(f"{order}HHI", entries, at)
        if kind in _FORMATS and 0 < length <= _MOST_VALUES:
            tags[tag] = _values(file, f"{order}{length}{_FORMATS[kind]}", entries[at + 8 : at + 12])
    return tags


def read_size(file: BinaryIO) -> tuple[int, int]:
    """Return the width and height of the first picture, px.

    Raises:
        struct.error, KeyError: The file ends early, or does not say.
    """
    tags = read_tags(file)
    return tags[WIDTH][0], tags[HEIGHT][0]


def _values(file: BinaryIO, layout: str, field: bytes) -> tuple[int, ...]:
    """Return the values of a tag: in its field, or where that leads if they have no room there."""
    size = struct.calcsize(layout)
    if size > len(field):
        file.seek(struct.unpack(f"{layout[0]}I", field)[0])
        field = file.read(size)
    return struct.unpack_from(layout, field)
