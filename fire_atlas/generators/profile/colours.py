"""The spatial fire colour correlation table: mean colour by place (Lee et al., III-B)."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Pixels, linear_to_srgb


@dataclass(frozen=True, slots=True)
class ColourTable:
    """Mean colour of every part of the flame.

    Attributes:
        colours: (n, n, 3) uint8 sRGB, straight: rows from the top of the flame's box down.
        coverage: (n, n) float32, 0..1: how much of the cell is flame, on average.
    """

    colours: Bytes
    coverage: NDArray[np.float32]


def colour_table(frames: Iterable[tuple[Pixels, NDArray[np.bool_]]], size: int) -> ColourTable:
    """Table of ``size`` by ``size`` cells, each frame's flame box divided evenly.

    Args:
        frames: The fire alone, and the mask (H, W) of its connected flame.
        size: Cells in a row and in a column; the paper has 5.
    """
    total, area = np.zeros((size * size, 4)), np.zeros(size * size)
    for pixels, flame in frames:
        rows, columns = np.flatnonzero(flame.any(axis=1)), np.flatnonzero(flame.any(axis=0))
        if not rows.size:
            continue
        box = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        seen = (pixels[box] * flame[box][..., None]).reshape(-1, 4)
        cell = np.add.outer(_cells(rows, size) * size, _cells(columns, size)).ravel()
        for channel in range(4):
            total[:, channel] += np.bincount(cell, seen[:, channel], size * size)
        area += np.bincount(cell, minlength=size * size)
    alpha = total[:, 3]
    straight = np.divide(
        total[:, :3], alpha[:, None], np.zeros((size * size, 3)), where=alpha[:, None] > 0
    )
    colours = np.rint(linear_to_srgb(np.clip(straight, 0, 1)) * 255).astype(np.uint8)
    coverage = np.divide(alpha, area, np.zeros(size * size), where=area > 0).astype(np.float32)
    return ColourTable(colours.reshape(size, size, 3), coverage.reshape(size, size))


def _cells(extent: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Return the cell of every row (column) from the first to the last of ``extent``."""
    length = int(extent[-1] - extent[0]) + 1
    return np.arange(length) * size // length
