"""Uncompressed OpenEXR files that the package OpenEXR does not write: colours of reduced size, and
tiles of several levels."""

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Plane = NDArray[np.float32]

_FLOAT = 2


def header(
    steps: Mapping[str, int],
    data: tuple[int, int, int, int],
    display: tuple[int, int, int, int],
    attributes: Mapping[str, tuple[str, bytes]],
    flags: int = 0,
) -> bytes:
    """Magic, version and attributes; ``steps``: by channel, the distance of its samples, px.
    Windows are left, top, and the last column and row."""
    channels = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", _FLOAT, 0, step, step)
        for name, step in sorted(steps.items())
    )
    everything: dict[str, tuple[str, bytes]] = {
        "channels": ("chlist", channels + b"\0"),
        "compression": ("compression", b"\0"),
        "dataWindow": ("box2i", struct.pack("<4i", *data)),
        "displayWindow": ("box2i", struct.pack("<4i", *display)),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1)),
        "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": ("float", struct.pack("<f", 1)),
        **attributes,
    }
    parts = [
        name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
        for name, (kind, value) in everything.items()
    ]
    return b"v/1\x01" + struct.pack("<I", 2 | flags) + b"".join(parts) + b"\0"


def lines(
    planes: Mapping[str, tuple[Plane, int]],
    data: tuple[int, int, int, int],
    display: tuple[int, int, int, int] | None = None,
    attributes: Mapping[str, tuple[str, bytes]] | None = None,
) -> bytes:
    """A file of scan lines; ``planes``: by channel, its samples and their distance, px."""
    steps = {name: step for name, (_, step) in planes.items()}
    rows = []
    for y in range(data[1], data[3] + 1):
        samples = b"".join(
            plane[y // step - -(-data[1] // step)].astype("<f4").tobytes()
            for _, (plane, step) in sorted(planes.items())
            if y % step == 0
        )
        rows.append(struct.pack("<ii", y, len(samples)) + samples)
    return _with_table(header(steps, data, display or data, attributes or {}), rows)


def mipmap(planes: Mapping[str, Plane], side: int) -> bytes:
    """A file of square tiles, with all levels down to one pixel."""
    height, width = next(iter(planes.values())).shape
    window = 0, 0, width - 1, height - 1
    tiles = {"tiles": ("tiledesc", struct.pack("<IIB", side, side, 1))}
    head = header(dict.fromkeys(planes, 1), window, window, tiles, flags=0x200)
    chunks, level = [], 0
    while True:
        for top in range(0, height, side):
            for left in range(0, width, side):
                samples = b"".join(
                    plane[y, left : min(left + side, width)].astype("<f4").tobytes()
                    for y in range(top, min(top + side, height))
                    for _, plane in sorted(planes.items())
                )
                place = left // side, top // side, level, level, len(samples)
                chunks.append(struct.pack("<5i", *place) + samples)
        if height == width == 1:
            return _with_table(head, chunks)
        height, width, level = max(1, height // 2), max(1, width // 2), level + 1
        planes = {name: plane[::2, ::2] for name, plane in planes.items()}


def _with_table(head: bytes, chunks: list[Any]) -> bytes:
    ends = len(head) + 8 * len(chunks) + np.cumsum([0, *map(len, chunks)])
    return head + struct.pack(f"<{len(chunks)}Q", *ends[:-1].tolist()) + b"".join(chunks)
