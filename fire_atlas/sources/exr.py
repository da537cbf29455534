"""Read OpenEXR files (linear light, premultiplied by convention) with the package ``OpenEXR``.

The package prints errors on stdout and stderr and cannot be silenced. So it runs in separate
processes (``exr_decoder.py``), one for each thread that reads EXR.
"""

import importlib.util
import json
import subprocess
import sys
import threading
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import as_plane
from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.colours import (
    SRGB_PRIMARIES,
    Chromaticities,
    Matrix,
    matrix_to_srgb,
    with_matrix,
    xyz_of,
)
from fire_atlas.sources.exr_header import Channel, Part, read_parts
from fire_atlas.sources.exr_layers import Kind, Layer, choose_layer

_PROGRAM = str(Path(__file__).with_name("exr_decoder.py"))
_LARGEST_OVERSCAN = 4
"""Limit on the pixels of the data window, relative to the display window; larger is damaged."""

_MAX_DECODED = 4 << 30
"""Limit on the bytes of all channels of a file, which the package decodes at once."""

_of_thread = threading.local()


@dataclass(frozen=True, slots=True)
class ExrPicture:
    """The picture of an EXR file that is read.

    Attributes:
        layer: Its channels.
        part_count: Number of parts of the file.
        part: The one that holds it.
        primaries: Those of its colours.
        matrix: From these to Rec. 709; None if they are the same.
        notes: Which layer was chosen, and what was done to its colours, for the user.
    """

    layer: Layer
    part_count: int
    part: Part
    primaries: Chromaticities
    matrix: Matrix | None
    notes: tuple[str, ...]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the display window, px."""
        return _size(self.part.display)


def require_openexr(path: Path) -> None:
    """Raise ``SourceError`` if ``OpenEXR``, which the file ``path`` needs, is not installed."""
    if importlib.util.find_spec("OpenEXR") is None:
        raise SourceError(
            f"{path}: reading EXR needs OpenEXR; install it with: pip install 'fire-atlas[exr]'"
        )


def find_picture(path: Path, file: BinaryIO, layer: str | None) -> ExrPicture:
    """Return which picture of an EXR file is read, from its header.

    Args:
        path: The file, for messages.
        file: The same, opened.
        layer: The layer that the recipe names.

    Raises:
        SourceError: The choice of a layer is not clear, or there is none such.
        BrokenFileError: The header is cut short or damaged.
    """
    parts = read_parts(file)
    chosen, notes = choose_layer(path, parts, layer)
    part = parts[chosen.part]
    if _area(part.data) > _LARGEST_OVERSCAN * _area(part.display):
        raise BrokenFileError("its data window is far larger than its display window")
    decoded = sum(_area(stored_part.data) * _bytes_of_pixel(stored_part) for stored_part in parts)
    if decoded > _MAX_DECODED:
        raise SourceError(
            f"{path}: all its channels are {decoded / 2**30:.1f} GiB, and at most "
            f"{_MAX_DECODED >> 30} are decoded; export fewer layers"
        )
    primaries, matrix = part.chromaticities or SRGB_PRIMARIES, None
    try:
        matrix = matrix_to_srgb(primaries)
    except ValueError as error:
        primaries = SRGB_PRIMARIES
        notes = (*notes, f"its chromaticities make no sense ({error}): they are taken as Rec. 709")
    if matrix is not None:
        notes = (*notes, "its colours are converted from the primaries that it states to Rec. 709")
    return ExrPicture(chosen, len(parts), part, primaries, matrix, notes)


def decode_exr(data: bytes, picture: ExrPicture) -> Picture:
    """Return the display window of a picture in an EXR file; 0 outside of its data.

    Returns:
        float32 (H, W, 3) or (H, W, 4), not limited to valid light.

    Raises:
        BrokenFileError: The file is cut short or damaged.
    """
    layer, part = picture.layer, picture.part
    names = [*layer.channels, *([layer.alpha] if layer.alpha else [])]
    planes = _decoded_planes(data, picture.part_count, layer.part, names)
    channels = {channel.name: channel for channel in part.channels}
    planes = [
        _full_size(plane, channels[name], part) for name, plane in zip(names, planes, strict=True)
    ]
    colours, alpha = planes[: len(layer.channels)], planes[len(layer.channels) :]
    if layer.kind is Kind.LUMA_CHROMA:
        luma, red_chroma, blue_chroma = colours
        colours = _rgb_of(luma, red_chroma, blue_chroma, picture.primaries)
    elif layer.kind is Kind.GREY:
        colours = 3 * colours
    stored = np.dstack([*colours, *alpha])
    if picture.matrix is not None:
        stored = with_matrix(stored, picture.matrix)
    return _in_display(stored, part)


def _full_size(plane: NDArray[np.float32], channel: Channel, part: Part) -> NDArray[np.float32]:
    """Return a channel with a value for each pixel of the data window, interpolated between its
    samples, which lie at places that the steps divide."""
    if (channel.step_x, channel.step_y) == (1, 1):
        return plane
    left, top, right, bottom = part.data
    across = _interpolated(plane.T, left, right, channel.step_x).T
    return _interpolated(across, top, bottom, channel.step_y)


def _interpolated(
    samples: NDArray[np.float32], start: int, stop: int, step: int
) -> NDArray[np.float32]:
    """Return rows ``start`` to ``stop`` of samples whose rows lie at every ``step``-th place."""
    first = -(-start // step) * step
    at = np.clip((np.arange(start, stop) - first) / step, 0, len(samples) - 1)
    before = at.astype(int)
    after = np.minimum(before + 1, len(samples) - 1)
    weight = (at - before).astype(np.float32)[:, None]
    return as_plane(samples[before] * (1 - weight) + samples[after] * weight)


def _rgb_of(
    luma: NDArray[np.float32],
    red_chroma: NDArray[np.float32],
    blue_chroma: NDArray[np.float32],
    chromaticities: Chromaticities,
) -> list[NDArray[np.float32]]:
    """Return R, G, B of luminance Y and chroma (R - Y) / Y and (B - Y) / Y."""
    of_red, of_green, of_blue = xyz_of(chromaticities)[1].astype(np.float32)
    red, blue = (red_chroma + 1) * luma, (blue_chroma + 1) * luma
    return [red, (luma - of_red * red - of_blue * blue) / of_green, blue]


def _in_display(stored: NDArray[np.float32], part: Part) -> Picture:
    """Return the display window of pixels that fill the data window."""
    width, height = _size(part.display)
    picture = np.zeros((height, width, stored.shape[2]), np.float32)
    left, top = max(part.data.left, part.display.left), max(part.data.top, part.display.top)
    right = max(left, min(part.data.right, part.display.right))
    bottom = max(top, min(part.data.bottom, part.display.bottom))
    shared = Window(left, top, right, bottom)
    picture[_within(shared, part.display)] = stored[_within(shared, part.data)]
    return picture


def _within(window: Window, outer: Window) -> tuple[slice, slice]:
    """Return the rows and columns of a window in a picture that fills ``outer``."""
    rows = slice(window.top - outer.top, window.bottom - outer.top)
    return rows, slice(window.left - outer.left, window.right - outer.left)


def _size(window: Window) -> tuple[int, int]:
    return window.right - window.left, window.bottom - window.top


def _area(window: Window) -> int:
    width, height = _size(window)
    return width * height


def _bytes_of_pixel(part: Part) -> int:
    return sum(channel.sample_bytes for channel in part.channels)


def _decoded_planes(
    data: bytes, part_count: int, part: int, channels: list[str]
) -> list[NDArray[np.float32]]:
    """Return channels from this thread's decoder, which is started on first use."""
    if not hasattr(_of_thread, "decoder"):
        _of_thread.decoder = _Decoder()
    try:
        decoder: _Decoder = _of_thread.decoder
        reply, planes = decoder.ask(data, part_count, part, channels)
    except (OSError, ValueError) as error:
        del _of_thread.decoder
        raise BrokenFileError("this EXR ended the process that decodes it") from error
    if "error" in reply:
        raise BrokenFileError(f"the file is truncated or damaged ({reply['error']})")
    return planes


class _Decoder:
    """A process that decodes EXR files. It ends with this object or with the build."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C must not reach it
        )
        weakref.finalize(self, self._process.communicate)

    def ask(
        self, data: bytes, part_count: int, part: int, channels: list[str]
    ) -> tuple[dict[str, Any], list[NDArray[np.float32]]]:
        """Return the reply to a request; raise OSError or ValueError if the process has ended."""
        requests, replies = self._process.stdin, self._process.stdout
        assert requests is not None
        assert replies is not None
        about = {"length": len(data), "parts": part_count, "part": part, "channels": channels}
        requests.write(json.dumps(about).encode() + b"\n" + data)
        requests.flush()
        reply = json.loads(replies.readline())
        planes = []
        for shape in reply.get("shapes", []):
            rows = replies.read(4 * int(np.prod(shape)))
            planes.append(np.frombuffer(rows, np.float32).reshape(shape))
        return reply, planes
