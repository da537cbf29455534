"""Cut a sprite sheet into equal cells, whose size need not be whole pixels."""

from functools import partial
from math import ceil, floor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture, to_light
from fire_atlas.core.pixels import Plane
from fire_atlas.recipe.source import Grid
from fire_atlas.sources.images import decode, read_header
from fire_atlas.sources.listing import MAX_PIXELS
from fire_atlas.sources.reader import FrameReader
from fire_atlas.vision.warp import sample_at

_MIN_CELLS, _MAX_CELLS = 4, 32
"""Minimum number of cells of a likely sheet, and maximum along each axis."""

_VISIBLE = 2 / 255
"""Alpha above which a pixel counts as visible."""


def open_sheet(path: Path, grid: Grid, max_pixels: int = MAX_PIXELS) -> FrameReader:
    """Open the cells of a sheet as frames, left to right, top to bottom.

    Cells of whole pixels are copied unchanged. Others are sampled at their exact positions, in
    premultiplied light, into frames of the nearest whole size.

    Raises:
        SourceError: The image is broken, or has fewer columns or rows of pixels than of cells.
    """
    header = read_header(path, max_pixels)
    if grid.columns > header.width or grid.rows > header.height:
        raise SourceError(
            f"{path}: a grid of {grid.columns} columns x {grid.rows} rows cannot be cut from "
            f"{header.width}x{header.height} pixels; a cell needs at least one pixel"
        )
    sheet = decode(path, header)
    sheet.flags.writeable = False
    whole = header.width % grid.columns == 0 and header.height % grid.rows == 0
    return FrameReader(
        width=_nearest(header.width / grid.columns),
        height=_nearest(header.height / grid.rows),
        fps=None,
        count=grid.columns * grid.rows,
        read=partial(_whole_cell if whole else _fractional_cell, sheet, grid),
        inputs=(path,),
    )


def likely_grid(cover: Plane) -> tuple[int, int] | None:
    """Return the columns and rows of a picture that looks like a sheet of frames; None if not.

    It does if equal cells, at least ``_MIN_CELLS``, all show something, and nothing crosses the
    lines between them. ``cover``: (H, W), the picture's alpha.
    """
    visible = cover > _VISIBLE
    columns, rows = (_cells_along(np.asarray(visible.any(axis=axis))) for axis in (0, 1))
    return (columns, rows) if columns * rows >= _MIN_CELLS else None


def _cells_along(visible: NDArray[np.bool_]) -> int:
    """Return the maximum number of equal cells along an axis that no visible pixel crosses.

    ``visible``: (n,), whether each column, or row, of the picture shows anything.
    """
    for count in range(_MAX_CELLS, 1, -1):
        length = len(visible) // count
        edges = np.arange(1, count) * length
        is_even = length * count == len(visible) and length > 1
        if not is_even or (visible[edges - 1] | visible[edges]).any():
            continue
        if visible.reshape(count, length).any(axis=1).all():
            return count
    return 1


def _nearest(length: float) -> int:
    return floor(length + 0.5)


def _whole_cell(sheet: Picture, grid: Grid, i: int) -> Picture:
    row, column = divmod(i, grid.columns)
    height, width = sheet.shape[0] // grid.rows, sheet.shape[1] // grid.columns
    top, left = row * height, column * width
    return sheet[top : top + height, left : left + width]


def _fractional_cell(sheet: Picture, grid: Grid, i: int) -> Picture:
    """Return cell i as light (H, W, 4), by bilinear sampling; its edges may lie within pixels."""
    row, column = divmod(i, grid.columns)
    top, bottom, y = _sample_positions(row, sheet.shape[0] / grid.rows)
    left, right, x = _sample_positions(column, sheet.shape[1] / grid.columns)
    light = to_light(sheet[top:bottom, left:right])
    across, down = np.meshgrid(x, y)
    return sample_at(light, across, down)


def _sample_positions(
    cell: int, length: float
) -> tuple[int, int, np.ndarray[tuple[int], np.dtype[np.float32]]]:
    """Return the first pixel that a cell touches, the one past its last, and sample positions.

    There is a position for the centre of each output pixel, as an index counted from the first
    pixel. Sampling reads no pixels beyond these, so that a neighbour cell shows only where its edge
    runs through a pixel.
    """
    start, stop = cell * length, (cell + 1) * length
    # Tolerates rounding: 3 * (512 / 12) need not be exactly 128.
    first, last = floor(start + 1e-6), ceil(stop - 1e-6)
    steps = _nearest(length)
    centres = start + (np.arange(steps) + 0.5) * (length / steps)
    return first, last, (centres - 0.5 - first).astype(np.float32)
