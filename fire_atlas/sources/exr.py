"""OpenEXR: linear light, premultiplied by convention; decoded by FFmpeg through PyAV."""

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np

from fire_atlas.core.picture import Picture
from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.pyav import load_pyav

_LINES_PER_BLOCK = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)
"""Lines that are compressed together, by compression method."""


def exr_size(head: bytes) -> tuple[int, int]:
    """Return the width and height of the display window, px, from the file's header."""
    for name, at, _ in _attributes(head):
        if name == b"displayWindow":
            left, top, right, bottom = struct.unpack_from("<iiii", head, at)
            return right - left + 1, bottom - top + 1
    raise BrokenFileError("the header holds no displayWindow")


def decode_exr(data: bytes) -> Picture:
    """Return the picture in an EXR file as float32 light, (H, W, 3) or (H, W, 4).

    Raises:
        BrokenFileError: The file is cut short or of a kind that FFmpeg does not read.
        SourceError: PyAV is not installed.
    """
    av = load_pyav("EXR", "this frame")
    _check_whole(data)
    decoder = av.CodecContext.create("exr", "r")
    decoder.thread_count = 1
    try:
        frames = decoder.decode(av.Packet(data)) + decoder.decode(None)
        light = _planes(frames[0])
    except (av.FFmpegError, ValueError, IndexError) as error:
        raise BrokenFileError(f"this EXR cannot be read ({error})") from error
    return finite_light(light)


def finite_light(values: Picture) -> Picture:
    """Return float32 light as a file holds it, (H, W, 3) or (H, W, 4), without what is no light."""
    light = np.nan_to_num(values, nan=0.0, posinf=65504.0, neginf=0.0)
    np.maximum(light, 0, out=light)
    if light.shape[2] == 4:
        np.minimum(light[..., 3], 1, out=light[..., 3])
    return light


def _planes(frame: Any) -> Picture:
    """Return FFmpeg's planes, half or single floats in the order G, B, R(, A), as one picture."""
    orders = {"gbrp": (2, 0, 1), "gbrap": (2, 0, 1, 3), "gray": (0, 0, 0)}
    layout, _, kind = frame.format.name.partition("f")
    if layout not in orders or kind not in ("16le", "32le"):
        raise ValueError(f"its pixels are laid out as {frame.format.name}")
    number = np.dtype("<f2" if kind == "16le" else "<f4")
    planes = [
        np.frombuffer(plane, number).reshape(frame.height, -1)[:, : frame.width]
        for plane in frame.planes
    ]
    return np.dstack([planes[i] for i in orders[layout]]).astype(np.float32)


def _attributes(data: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Yield name, start and stop of each header attribute, then an empty name where it ends."""
    at = 8
    while data[at]:
        name_end = data.index(b"\0", at)
        kind_end = data.index(b"\0", name_end + 1)
        (length,) = struct.unpack_from("<i", data, kind_end + 1)
        start = kind_end + 5
        yield data[at:name_end], start, start + length
        at = start + length
    yield b"", at, at + 1


def _check_whole(data: bytes) -> None:
    """Refuse files that end early: FFmpeg would fill the missing lines with black."""
    try:
        found = {name: at for name, at, _ in _attributes(data)}
        _, top, _, bottom = struct.unpack_from("<iiii", data, found[b"dataWindow"])
        tiled_or_multipart = data[5] & 0x12
        if tiled_or_multipart:
            return
        lines = _LINES_PER_BLOCK[data[found[b"compression"]]]
        blocks = -(-(bottom - top + 1) // lines)
        for at in struct.unpack_from(f"<{blocks}Q", data, found[b""] + 1):
            _, length = struct.unpack_from("<ii", data, at)
            if at + 8 + length > len(data):
                raise IndexError
    except (IndexError, ValueError, KeyError, struct.error) as error:
        raise BrokenFileError("the file is truncated or its header is damaged") from error
