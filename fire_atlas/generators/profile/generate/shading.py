"""Colours that the clip shows at each cell of the detail's grid, by brightness."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from fire_atlas.core.pixels import REC709, Pixels, Plane, as_plane
from fire_atlas.generators.profile.model import Profile, Side, decoded_shades

_LIGHT_STEPS = 64
"""Number of steps of light by which colours are averaged."""


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
        start = lower * rank.size + np.arange(rank.size, dtype=np.int32)
        # Four channels as one value of 128 bits are copied much faster.
        shades = self.shades.view(np.complex128).reshape(-1)
        dim, bright = (shades.take(at).view(np.float32) for at in (start, start + rank.size))
        dim += (bright - dim) * np.repeat(place - lower, 4)
        return dim.reshape(*rank.shape, 4)


def shade_table(profile: Profile, azimuth: float) -> ShadeTable:
    """Return the shades seen from ``azimuth``, radians.

    Between the front and the side they are interpolated; from behind they are mirrored.
    """
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    if sin * sin < 1e-9:
        seen = _shades(profile.sides[0], is_mirrored=cos <= 0)
    elif cos * cos < 1e-9:
        seen = _shades(profile.sides[-1], is_mirrored=sin <= 0)
    else:
        front = _shades(profile.sides[0], is_mirrored=cos <= 0)
        side = _shades(profile.sides[-1], is_mirrored=sin <= 0)
        seen = _between(front, side, sin * sin)
    return ShadeTable(len(seen), np.ascontiguousarray(seen.reshape(-1, 4)))


def _shades(side: Side, *, is_mirrored: bool) -> Pixels:
    """Return the shades (levels, rows, columns, 4) of a side, as pixels."""
    return decoded_shades(side.detail.shades)[:, :, :: -1 if is_mirrored else 1]


def _between(one: Pixels, other: Pixels, share: float) -> Pixels:
    """Return shades (levels, rows, columns, 4) with a ``share`` of ``other`` in ``one``.

    The mean of bright fire and none is a thin veil of yellow, which over black is olive. What is as
    dim in the clip is red: the less alike two shades, the more of the clip's own colour of that
    light is taken.
    """
    mean = one + (other - one) * np.float32(share)
    dim, bright = _light(one), _light(other)
    light = dim + (bright - dim) * np.float32(share)
    unlike = 4 * share * (1 - share) * np.abs(bright - dim) / np.maximum(bright + dim, 1e-6)
    mean += (_coloured(light, one) - mean) * unlike[..., None].astype(np.float32)
    return mean


def _coloured(light: Plane, shades: Pixels) -> Pixels:
    """Return the mean colours (..., 4) that ``shades`` have where they have as much ``light``."""
    steps = _light(shades) * np.float32(_LIGHT_STEPS)
    place = np.rint(steps).astype(np.intp).ravel()
    count = np.bincount(place, minlength=_LIGHT_STEPS + 1)
    known = np.flatnonzero(count)
    wanted = light * np.float32(_LIGHT_STEPS)
    channels = [
        np.interp(wanted, known, np.bincount(place, channel.ravel())[known] / count[known])
        for channel in np.moveaxis(shades, -1, 0)
    ]
    return np.stack(channels, axis=-1).astype(np.float32)


def _light(shades: Pixels) -> Plane:
    """Return the root of the luminance (...) of premultiplied shades, which steps as the eye has
    them."""
    return as_plane(np.sqrt(np.clip(shades[..., :3] @ REC709, 0, 1)))


def taper_of(profile: Profile) -> Polynomial:
    """Return the half width of the flame by height, in half widths of its foot: a cubic."""
    heights = np.array([0.0, 0.35, 0.7, 1.05])
    return Polynomial.fit(heights, [_half_width(profile, height) for height in heights], 3)


def _half_width(profile: Profile, height: float) -> float:
    """Half width, in half widths of the foot, within which the flame often is at ``height``."""
    grid, shades = profile.grid, profile.front.detail.shades
    row = grid.rows_above - height * grid.cells_per_height - 1
    row = int(np.clip(row, 0, grid.shape[0] - 1))
    often_flame = shades[3 * len(shades) // 4, row, :, 3] > 48
    if not often_flame.any():
        return 0.3
    return max(0.3, float(np.abs(grid.offsets[often_flame]).max()))
