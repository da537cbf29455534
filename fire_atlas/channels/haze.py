"""Haze: how far the hot air of a fire shifts what is seen through it.

Light bends towards denser air, as the refractive index of air exceeds 1 in proportion to its
density (Gladstone and Dale): what is seen is shifted along the density's gradient.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import Rect
from fire_atlas.channels.motion import FrameVectors, longest_of
from fire_atlas.core.pixels import Plane, as_plane, magnitude

_STRENGTH = 7e-4
"""Shift where the density of the air changes by that of cold air in a frame height, heights."""

_EDGE = 0.08
"""Width along the borders of a frame over which haze fades to nothing, frame heights."""

_SEEN = 0.2
"""Shift from which haze is worth a place on the page, px."""


@dataclass(frozen=True, slots=True)
class Haze:
    """The haze of every frame of an animation, on the grid of its buoyancy field.

    Attributes:
        width, height: Size of the part of the frame that the grid covers, px: at least the frame.
        cells: One array per frame, (rows, columns, 2): where what is seen through the air at the
            middle of a cell really is, px to the right and down from there.
        longest: Maximum length of shifts along x and along y, px, without outliers.
    """

    width: int
    height: int
    cells: tuple[NDArray[np.float16], ...]
    longest: tuple[float, float]

    def frames(self) -> list[FrameVectors]:
        """Return the frames, in playing order."""
        return [FrameVectors(cell, self.width, self.height) for cell in self.cells]

    def seen(self, frame: int) -> Rect | None:
        """Return the rectangle of a frame in which haze is seen, px; None if nowhere."""
        shift = self.cells[frame].astype(np.float32)
        seen = magnitude(shift[..., 0], shift[..., 1]) > _SEEN
        rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
        if not rows.size:
            return None
        cell = self.height // len(shift)
        # Shifts are interpolated between the middles of cells.
        left, top = max(int(columns[0]) - 1, 0) * cell, max(int(rows[0]) - 1, 0) * cell
        right, bottom = (int(columns[-1]) + 2) * cell, (int(rows[-1]) + 2) * cell
        return Rect(left, top, right - left, bottom - top)


def haze_of(thinness: Iterable[Plane], kappa: Plane, cell: int) -> Haze:
    """Return the haze of an animation.

    Args:
        thinness: Of each frame, (rows, columns): how much less dense the air is than cold air.
        kappa: (H, W) height weight [κ], from 0 at the bottom of the flame to 1 at its top and
            above: hot air builds up on its way, and the ground beneath a fire stays as it is.
        cell: Side of a cell of the grid, px.
    """
    unit, cells = np.float32(_STRENGTH * len(kappa) ** 2 / cell), list[NDArray[np.float16]]()
    for thin in thinness:
        down, right = np.gradient(-thin)
        shift = np.stack([right, down], axis=2) * _weight(kappa, thin.shape, cell)
        cells.append((shift * unit).astype(np.float16))
    rows, columns = cells[0].shape[:2]
    return Haze(columns * cell, rows * cell, tuple(cells), longest_of(cells))


def _weight(kappa: Plane, shape: tuple[int, int], cell: int) -> NDArray[np.float32]:
    """Return the factor of each cell's haze, (rows, columns, 1): κ, and 0 at the frame's border."""
    height, width = kappa.shape
    x, y = ((np.arange(count) + 0.5) * cell for count in (shape[1], shape[0]))
    edge = _EDGE * height
    across = np.clip(np.minimum(x, width - x) / edge, 0, 1)
    along = np.clip(np.minimum(y, height - y) / edge, 0, 1)
    centres = np.meshgrid(np.minimum(x, width - 1), np.minimum(y, height - 1))
    column, row = (each.astype(np.intp) for each in centres)
    inside = np.outer(along, across)
    return as_plane((kappa[row, column] * inside * inside * (3 - 2 * inside))[..., None])
