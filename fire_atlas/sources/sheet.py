"""Cut a sprite sheet into equal cells, whose size need not be whole pixels."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import ceil, floor
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture, to_light
from fire_atlas.core.pixels import Plane
from fire_atlas.core.workload import MAX_FRAMES, MAX_PIXELS
from fire_atlas.recipe.source import Grid
from fire_atlas.sources.images import decode, read_header
from fire_atlas.sources.reader import FrameReader
from fire_atlas.vision.warp import sample_at

_MIN_CELLS, _MAX_CELLS = 4, 32
"""Minimum number of cells of a likely sheet, and maximum along each axis."""

_VISIBLE = 2 / 255
"""Alpha above which a pixel counts as visible."""


@dataclass(frozen=True, slots=True)
class _Cells:
    """Equal cells along one axis of a sheet.

    Attributes:
        count: Number of cells.
        first: Where the first one begins, px.
        length: Their length, px; need not be whole.
        step: Distance from one to the next, px.
        rest: Pixels behind the last cell that are no whole one.
    """

    count: int
    first: int
    length: float
    step: float
    rest: int = 0


def open_sheet(
    path: Path, grid: Grid, max_pixels: int = MAX_PIXELS, layer: str | None = None
) -> FrameReader:
    """Open the cells of a sheet as frames, left to right, top to bottom.

    Cells of whole pixels are copied unchanged. Others are sampled at their exact positions, in
    premultiplied light, into frames of the nearest whole size.

    Raises:
        SourceError: The image is broken, or too small for one pixel, or one cell, of its grid.
    """
    header = read_header(path, max_pixels, layer)
    columns = _cells_of(header.width, grid.columns, grid.cell and grid.cell[0], grid)
    rows = _cells_of(header.height, grid.rows, grid.cell and grid.cell[1], grid)
    if columns is None or rows is None:
        raise SourceError(f"{path}: {_unfit(grid, header.width, header.height)}")
    if columns.count * rows.count > MAX_FRAMES:
        raise SourceError(
            f"{path}: its grid has {columns.count} columns x {rows.count} rows, which are "
            f"{columns.count * rows.count} cells; at most {MAX_FRAMES} frames are allowed"
        )
    whole = columns.length.is_integer() and rows.length.is_integer()
    cell = _whole_cell if whole else _fractional_cell

    lock = Lock()

    @cache
    def decoded() -> Picture:
        picture = decode(path, header)
        picture.flags.writeable = False
        return picture

    def sheet() -> Picture:
        with lock:  # else several threads that come first would each decode it
            return decoded()

    return FrameReader(
        width=_nearest(columns.length),
        height=_nearest(rows.length),
        fps=None,
        count=columns.count * rows.count,
        read=lambda i: cell(sheet(), columns, rows, i),
        inputs=(path,),
        notes=(*header.notes, *_notes(columns, rows)),
    )


def _cells_of(total: int, count: int | None, length: int | None, grid: Grid) -> _Cells | None:
    """Return the cells along an axis of ``total`` px, by their count or else their length, px; None
    if there is no room for one."""
    room = total - 2 * grid.margin
    if length is not None:
        step = length + grid.spacing
        count = (room + grid.spacing) // step
        rest = room + grid.spacing - count * step
        return _Cells(count, grid.margin, float(length), step, rest) if count > 0 else None
    if count is None:
        raise ValueError("a grid has either the number of its cells or their size")
    covered = room - (count - 1) * grid.spacing
    if covered < count:
        return None
    return _Cells(count, grid.margin, covered / count, covered / count + grid.spacing)


def _unfit(grid: Grid, width: int, height: int) -> str:
    """Return why a grid cannot be cut from an image of this size."""
    borders = "".join(
        f", {name} {length}"
        for name, length in (("margin", grid.margin), ("spacing", grid.spacing))
        if length
    )
    if grid.cell is not None:
        what, needed = f"a cell of {grid.cell[0]}x{grid.cell[1]} px", "one cell must fit"
    else:
        what = f"a grid of {grid.columns} columns x {grid.rows} rows"
        needed = "a cell needs at least one pixel"
    return f"{what}{borders} cannot be cut from {width}x{height} pixels; {needed}"


def _notes(columns: _Cells, rows: _Cells) -> Iterator[str]:
    """Yield what of the image is no whole cell, and so not used."""
    rests = {"on the right": columns.rest, "at the bottom": rows.rest}
    left_out = " and ".join(f"{rest} px {where}" for where, rest in rests.items() if rest)
    if left_out:
        yield (
            f"its grid has {columns.count} columns x {rows.count} rows of whole cells; {left_out} "
            f"are no whole cell, and left out"
        )


def likely_grid(alpha: Plane) -> tuple[int, int] | None:
    """Return the columns and rows of a picture that looks like a sheet of frames; None if not.

    It does if equal cells, at least ``_MIN_CELLS``, all show something, and nothing crosses the
    lines between them. ``alpha``: (H, W), the picture's coverage.
    """
    visible = alpha > _VISIBLE
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


def _whole_cell(sheet: Picture, columns: _Cells, rows: _Cells, i: int) -> Picture:
    row, column = divmod(i, columns.count)
    height, width = int(rows.length), int(columns.length)
    top, left = rows.first + row * int(rows.step), columns.first + column * int(columns.step)
    return sheet[top : top + height, left : left + width]


def _fractional_cell(sheet: Picture, columns: _Cells, rows: _Cells, i: int) -> Picture:
    """Return cell i as light (H, W, 4), by bilinear sampling; its edges may lie within pixels."""
    row, column = divmod(i, columns.count)
    top, bottom, y = _sample_positions(row, rows)
    left, right, x = _sample_positions(column, columns)
    light = to_light(sheet[top:bottom, left:right])
    across, down = np.meshgrid(x, y)
    return sample_at(light, across, down)


def _sample_positions(
    cell: int, cells: _Cells
) -> tuple[int, int, np.ndarray[tuple[int], np.dtype[np.float32]]]:
    """Return the first pixel that a cell touches, the one past its last, and sample positions.

    There is a position for the centre of each output pixel, as an index counted from the first
    pixel. Sampling reads no pixels beyond these, so that a neighbour cell shows only where its edge
    runs through a pixel.
    """
    start = cells.first + cell * cells.step
    stop = start + cells.length
    # Tolerates rounding: 3 * (512 / 12) need not be exactly 128.
    first, last = floor(start + 1e-6), ceil(stop - 1e-6)
    steps = _nearest(cells.length)
    centres = start + (np.arange(steps) + 0.5) * (cells.length / steps)
    return first, last, (centres - 0.5 - first).astype(np.float32)
