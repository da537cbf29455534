"""Where in a frame which part of the clip is seen.

Particles mark the places they fly through as their splice's: the nearer and the younger, the more.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.profile.blaze import Blaze
from fire_atlas.generators.profile.particles import height_after, opacity

COARSE = 4
"""Cells, in a row and in a column, that share the weights of the particles."""

_NEARNESS = 5.0
"""How much more the front of the fire is seen than its middle: as e to this power."""

_FAINT = 0.002
"""Particles of a lesser weight are not drawn."""

_BILLBOARD = 0.16
"""Size of a particle: the standard deviation of its billboard, flame heights."""

_NARROWEST = 0.5
"""Least breadth of detail, in half widths of the foot, that billboards are made for."""


@dataclass(frozen=True, slots=True)
class Territory:
    """Where one splice is seen, and how.

    Attributes:
        side: Which clip.
        frames: Two neighbouring frames of it, and the share of the second.
        mirrored: Whether its heat is mirrored.
        weight: (r, c) float32, by coarse cell.
    """

    side: int
    frames: tuple[int, int, float]
    mirrored: bool
    weight: Plane


def territories(
    blaze: Blaze, azimuth: float, half: float, narrowing: CubicSpline, time: float
) -> list[Territory]:
    """Return where each splice is seen at a time.

    Args:
        blaze: The fire.
        azimuth: Radians the camera went round it.
        half: Half the width of its foot from there, flame heights.
        narrowing: Half its width by height, in half widths of its foot.
        time: In frames.
    """
    particles, grid = blaze.particles, blaze.profile.grid
    living, age = particles.alive(time)
    share = age / particles.life
    height = height_after(share * blaze.climb, blaze.profile.rise)
    wide = np.maximum(narrowing(np.minimum(height, 1.4)), 0.2)
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    across = particles.x[living] * cos + particles.z[living] * sin
    near = particles.x[living] * sin - particles.z[living] * cos
    weight = opacity(share) * np.exp(_NEARNESS * (near / np.abs(near).max(initial=1.0) - 1.0))
    weight *= particles.size[living]
    seen = np.flatnonzero(weight > _FAINT * weight.max(initial=0.0))
    rows, columns = (-(-length // COARSE) for length in grid.shape)
    size = particles.size[living][seen] * (0.7 + 0.6 * share[seen])
    tall = np.maximum(_BILLBOARD * grid.per_height / COARSE * size, 0.8)
    breadth = max(blaze.profile.front.face.breadth, _NARROWEST * grid.per_half)
    broad = np.maximum(0.3 * breadth / COARSE * size, 0.8)
    cy = (grid.up - height[seen] * grid.per_height) / COARSE
    # Half widths of the front as those of this view, which the grid's columns are.
    front = blaze.profile.front.face.half / half
    cx = (grid.side + (across * wide)[seen] * front * grid.per_half) / COARSE
    down = _bells(np.arange(rows) + 0.5, cy, tall) * weight[seen, None].astype(np.float32)
    right = _bells(np.arange(columns) + 0.5, cx, broad)
    return _gathered(blaze, azimuth, time, living[seen], down, right)


def _gathered(
    blaze: Blaze, azimuth: float, time: float, seen: NDArray[np.intp], down: Plane, right: Plane
) -> list[Territory]:
    """Sum the billboards of the particles ``seen`` that show the same."""
    particles, period = blaze.particles, blaze.particles.period
    behind = np.cos(blaze.planes - azimuth) < 0
    flies = particles.slice[seen]
    keys = blaze.sides[flies], blaze.clocks[flies], blaze.shown[seen], behind[flies]
    ranges = [int(key.max(initial=0)) + 1 for key in keys]
    kind_of = np.ravel_multi_index(keys, ranges)
    found = []
    for kind in np.unique(kind_of):
        side, clock, number, is_behind = (int(key) for key in np.unravel_index(kind, ranges))
        members = np.flatnonzero(kind_of == kind)
        splice = blaze.splices[side][clock][number]
        born = float(particles.born[seen[members[0]]])
        age = round((born - splice.start) % period + (time - born) % period, 6)
        first, second, part = blaze.reels[side].places(np.array(splice.first), np.array(age))
        found.append(
            Territory(
                side=side,
                frames=(int(first), int(second), float(part)),
                mirrored=splice.mirrored != bool(is_behind),
                weight=_summed(down[members], right[members]),
            )
        )
    return found


def _summed(down: Plane, right: Plane) -> Plane:
    """Sum of billboards (r, c), each the product of a column and a row of ``down`` (n, r) and
    ``right`` (n, c); squared, so that where two meet the border between them is narrow."""
    return as_plane(np.square(down.T @ right))


def _bells(
    at: NDArray[np.floating], middle: NDArray[np.floating], width: NDArray[np.floating]
) -> Plane:
    """(n, len(at)): a Gaussian about each ``middle``."""
    away = (at - middle[:, None]) / width[:, None]
    return as_plane(np.exp(-0.5 * away * away))
