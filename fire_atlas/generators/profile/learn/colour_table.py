"""The colour table of a clip: mean colours by place in its flame (Lee et al., III-B)."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels, linear_to_srgb
from fire_atlas.generators.profile.model import ColourTable


def cell_sums(pixels: Pixels, flame: NDArray[np.bool_], size: int) -> NDArray[np.float64]:
    """Return the sums of the pixels of a frame's flame in ``size`` by ``size`` cells of its box.

    Args:
        pixels: Pixels of the fire alone.
        flame: (H, W) mask of its largest flame.
        size: Cells in a row and in a column.

    Returns:
        (5, size · size): red, green, blue, coverage, and the number of pixels of the cell.
    """
    rows, columns = np.flatnonzero(flame.any(axis=1)), np.flatnonzero(flame.any(axis=0))
    sums = np.zeros((5, size * size))
    if not rows.size:
        return sums
    box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    inside, part = flame[box], pixels[box]
    cell = np.add.outer(_cells(rows, size) * size, _cells(columns, size)).ravel()
    for channel in range(4):  # numpy is slow along a short axis
        seen = (part[..., channel] * inside).ravel()
        sums[channel] = np.bincount(cell, seen, size * size)
    sums[4] = np.bincount(cell, minlength=size * size)
    return sums


def colour_table(sums: NDArray[np.float64]) -> ColourTable:
    """Return the mean colours of the cells of which ``sums``, added up over all frames, are those
    of ``cell_sums``."""
    *light, alpha, area = sums
    size = round(len(area) ** 0.5)
    straight = np.divide(light, alpha, np.zeros((3, size * size)), where=alpha > 0)
    shown = np.rint(linear_to_srgb(np.clip(straight, 0, 1)) * 255).astype(np.uint8)
    coverage = np.divide(alpha, area, np.zeros(size * size), where=area > 0).astype(np.float32)
    # As precise as in the profile file, so that both give the same fire.
    coverage = coverage.round(3)
    colours = np.ascontiguousarray(shown.T).reshape(size, size, 3)
    return ColourTable(colours, coverage.reshape(size, size))


def _cells(extent: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Return the cell of each row (or column) from the first to the last of ``extent``."""
    length = int(extent[-1] - extent[0]) + 1
    return np.arange(length) * size // length
