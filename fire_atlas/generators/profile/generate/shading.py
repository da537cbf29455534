"""Colours that the clip shows at each cell of the detail's grid, by brightness."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Pixels, Plane
from fire_atlas.generators.profile.model import Profile, decoded_shades


@dataclass(frozen=True, slots=True)
class ShadeTable:
    """Colours of every grid cell, by brightness.

    Attributes:
        levels: Number of shades.
        shades: (levels · rows · columns, 4) float32 pixels, dimmest level first.
    """

    levels: int
    shades: NDArray[np.float32]

    def colours(self, rank: Plane) -> Pixels:
        """Return the pixels of brightness ranks (rows, columns), 0 dimmest to 1 brightest."""
        place = rank.ravel() * np.float32(self.levels - 1)
        lower = np.minimum(place.astype(np.int32), self.levels - 2)
        share = (place - lower)[:, None]
        start = lower * rank.size + np.arange(rank.size, dtype=np.int32)
        dim = np.take(self.shades, start, axis=0)
        bright = np.take(self.shades, start + rank.size, axis=0)
        dim += (bright - dim) * share
        return dim.reshape(*rank.shape, 4)


def shade_table(profile: Profile, azimuth: float) -> ShadeTable:
    """Return the shades seen from ``azimuth``, radians.

    Between the front and the side they are interpolated; from behind they are mirrored.
    """
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    sides = profile.sides
    seen: NDArray[np.float32] | None = None
    for side, component in ((sides[0], cos), (sides[-1], sin)):
        share = np.float32(component * component)
        if share < 1e-9:
            continue
        shades = decoded_shades(side.detail.shades)
        part = (shades if component > 0 else shades[:, :, ::-1]) * share
        seen = part if seen is None else seen + part
    assert seen is not None, "cos² + sin² = 1"
    return ShadeTable(len(seen), np.ascontiguousarray(seen.reshape(-1, 4)))


def taper_of(profile: Profile) -> CubicSpline:
    """Return the half width of the flame by height, in half widths of its foot."""
    heights = np.array([0.0, 0.35, 0.7, 1.05])
    return CubicSpline(heights, [_half_width(profile, height) for height in heights])


def _half_width(profile: Profile, height: float) -> float:
    """Half width, in half widths of the foot, within which the flame often is at ``height``."""
    grid, shades = profile.grid, profile.front.detail.shades
    row = grid.rows_above - height * grid.cells_per_height - 1
    row = int(np.clip(row, 0, grid.shape[0] - 1))
    often_flame = shades[3 * len(shades) // 4, row, :, 3] > 48
    if not often_flame.any():
        return 0.3
    return max(0.3, float(np.abs(grid.offsets[often_flame]).max()))
