"""Masks of where in a frame each segment of the clip is seen: sums of the particles' billboards.

Particles mark the places they pass as their segment's: the nearer and the younger, the more.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.particles import height_after, opacity

MASK_CELL = 4
"""Cells of the grid, in a row and in a column, that share one weight of a mask."""

_FRONT_EMPHASIS = 5.0
"""The front of the fire weighs e to this power as much as its middle."""

_MIN_WEIGHT = 0.002
"""Particles of a lesser weight, relative to the largest, are not drawn."""

_BILLBOARD = 0.16
"""Size of a particle: the standard deviation of its billboard, flame heights."""

_MIN_CORRELATION_LENGTH = 0.5
"""Least correlation length, in half widths of the foot, that billboards are made for."""


@dataclass(frozen=True, slots=True)
class BlendMask:
    """Mask of one segment of the clip: where it is seen, and which of its frames.

    Attributes:
        side: Index of the profile's side whose clip it is.
        frames: Two neighbouring frames of the clip, and the weight of the second.
        mirrored: Whether they are mirrored.
        weight: (r, c) float32, for squares of ``MASK_CELL`` cells.
    """

    side: int
    frames: tuple[int, int, float]
    mirrored: bool
    weight: Plane


def blend_masks(
    fire: GeneratedFire, azimuth: float, half_width: float, taper: CubicSpline, time: float
) -> list[BlendMask]:
    """Return the masks of all segments that are seen at a time.

    Args:
        fire: The fire.
        azimuth: Of the camera, radians.
        half_width: Half the width of the foot from there, flame heights.
        taper: Half the width of the flame by height, in half widths of its foot.
        time: In frames of the fire's own time.
    """
    particles, grid, front = fire.particles, fire.profile.grid, fire.profile.front
    alive, age = particles.alive(time)
    share = age / particles.lifetime
    height = height_after(share * fire.rise_time, fire.profile.rise_speed)
    widening = np.maximum(taper(np.minimum(height, 1.4)), 0.2)
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    across = particles.x[alive] * cos + particles.z[alive] * sin
    near = particles.x[alive] * sin - particles.z[alive] * cos
    emphasis = np.exp(_FRONT_EMPHASIS * (near / np.abs(near).max(initial=1.0) - 1.0))
    weight = opacity(share) * emphasis
    weight *= particles.size[alive]
    seen = np.flatnonzero(weight > _MIN_WEIGHT * weight.max(initial=0.0))
    rows, columns = (-(-length // MASK_CELL) for length in grid.shape)
    size = particles.size[alive][seen] * (0.7 + 0.6 * share[seen])
    sigma_y = np.maximum(_BILLBOARD * grid.cells_per_height / MASK_CELL * size, 0.8)
    length = max(front.detail.correlation_length, _MIN_CORRELATION_LENGTH * grid.cells_per_half)
    sigma_x = np.maximum(0.3 * length / MASK_CELL * size, 0.8)
    y = (grid.rows_above - height[seen] * grid.cells_per_height) / MASK_CELL
    # Half widths of the front as those of this view, which the grid's columns are.
    ratio = front.half_width / half_width
    x = (grid.half_columns + (across * widening)[seen] * ratio * grid.cells_per_half) / MASK_CELL
    down = _gaussians(np.arange(rows) + 0.5, y, sigma_y) * weight[seen, None].astype(np.float32)
    right = _gaussians(np.arange(columns) + 0.5, x, sigma_x)
    return _summed_by_segment(fire, azimuth, time, alive[seen], down, right)


def _summed_by_segment(
    fire: GeneratedFire,
    azimuth: float,
    time: float,
    seen: NDArray[np.intp],
    down: Plane,
    right: Plane,
) -> list[BlendMask]:
    """Sum the billboards of the particles ``seen`` that show the same.

    A billboard is the product of a column of ``down`` (n, r) and a row of ``right`` (n, c). Sums
    are squared, so that where two masks meet the border between them is narrow.
    """
    particles, period = fire.particles, fire.period
    behind = np.cos(fire.slice_azimuths - azimuth) < 0
    of_slice = particles.slice[seen]
    keys = (
        fire.slice_sides[of_slice], fire.slice_tracks[of_slice],
        fire.particle_segments[seen], behind[of_slice],
    )  # fmt: skip
    ranges = [int(key.max(initial=0)) + 1 for key in keys]
    kinds = np.ravel_multi_index(keys, ranges)
    masks = []
    for kind in np.unique(kinds):
        side, track, number, is_behind = (int(key) for key in np.unravel_index(kind, ranges))
        members = np.flatnonzero(kinds == kind)
        segment = fire.tracks[side][track][number]
        birth = float(particles.birth[seen[members[0]]])
        age = round((birth - segment.start) % period + (time - birth) % period, 6)
        lower, upper, share = fire.sequences[side].frames_at(np.array(segment.first), np.array(age))
        masks.append(
            BlendMask(
                side=side,
                frames=(int(lower), int(upper), float(share)),
                mirrored=segment.mirrored != bool(is_behind),
                weight=as_plane(np.square(down[members].T @ right[members])),
            )
        )
    return masks


def _gaussians(
    at: NDArray[np.floating], middle: NDArray[np.floating], sigma: NDArray[np.floating]
) -> Plane:
    """(n, len(at)): a Gaussian about each ``middle``."""
    distance = (at - middle[:, None]) / sigma[:, None]
    return as_plane(np.exp(-0.5 * distance * distance))
