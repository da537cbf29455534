"""Blend masks: how much of each frame of the clip is seen at each place of a generated frame.

Slices lag one another, so that they show different moments. The mask of a moment is the sum of the
billboards of the particles of its slices; near ones count more. All particles end at the flame's
top, so that shows one moment: that of the slices that do not lag.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire, frames_of
from fire_atlas.generators.profile.generate.particles import height_after, opacity

MASK_CELL = 4
"""Side of the square of grid cells that share one weight of a mask."""

_FRONT_EMPHASIS = 5.0
"""Particles nearest to the camera weigh e to this power as much as those on the axis."""

_MIN_WEIGHT = 0.002
"""Minimum weight of a drawn particle, relative to the largest."""

_BILLBOARD = 0.16
"""Standard deviation of a particle's billboard, flame heights."""

_CUT_OFF = np.float32(6.0)
"""Distance at which a billboard ends, standard deviations."""

_MIN_CORRELATION_LENGTH = 0.5
"""Minimum correlation length, in half widths of the foot, that sets the width of billboards."""

_MERGING, _MERGED = 0.4, 0.75
"""Heights between which particles of slices that lag fade, flame heights."""

_LEADING = 0.05
"""Minimum weight of slices that do not lag, relative to the largest: they are seen everywhere."""


@dataclass(frozen=True, slots=True)
class BlendMask:
    """Where a frame of the clip is seen.

    Attributes:
        plane: Index of the plane whose clip it is from.
        frame: Number of the frame.
        mirrored: Whether it is mirrored left to right.
        weight: (r, c) float32, one for each square of ``MASK_CELL`` by ``MASK_CELL`` cells.
    """

    plane: int
    frame: int
    mirrored: bool
    weight: Plane


@dataclass(frozen=True, slots=True)
class _Billboards:
    """Billboards of the visible particles, as outer products of ``down[i]`` and ``right[i]``.

    Attributes:
        down: (n, r) weight by row.
        right: (n, c) weight by column.
        slices: (n,) slice of each particle.
    """

    down: Plane
    right: Plane
    slices: NDArray[np.intp]


def blend_masks(
    fire: GeneratedFire, azimuth: float, half_width: float, taper: Polynomial, time: float
) -> list[BlendMask]:
    """Return the masks of all frames of the clip that are visible at ``time``.

    Args:
        fire: The fire.
        azimuth: Direction of the camera, radians.
        half_width: Half width of the foot seen from that direction, flame heights.
        taper: Half width of the flame by height, in half widths of its foot.
        time: Time in frames of the fire's own time.
    """
    boards = _billboards(fire, azimuth, half_width, taper, time)
    behind = np.cos(fire.slice_azimuths - azimuth) < 0
    keys = np.stack([fire.slice_planes, fire.slice_tracks, behind]).T
    found: dict[tuple[int, int, bool], Plane] = {}
    groups, group = np.unique(keys, axis=0, return_inverse=True)
    for k, (plane, track, is_behind) in enumerate(groups):
        shows = group[boards.slices] == k
        weight = np.square(boards.down[shows].T @ boards.right[shows])
        if track == 0:
            weight = weight + np.float32(_LEADING) * weight.max(initial=1e-6)
        lag = float(fire.lags[track])
        for moment in fire.planes[plane].playback.moments(time - lag):
            for frame, share in frames_of(moment):
                key = int(plane), frame, moment.mirrored != bool(is_behind)
                part = as_plane(weight * np.float32(share))
                found[key] = found[key] + part if key in found else part
    return [BlendMask(*key, weight) for key, weight in found.items()]


def _billboards(
    fire: GeneratedFire, azimuth: float, half_width: float, taper: Polynomial, time: float
) -> _Billboards:
    """Return the billboards of the visible particles; arguments as for ``blend_masks``."""
    particles, grid, front = fire.particles, fire.profile.grid, fire.profile.front
    alive, age = particles.alive(time)
    life = age / particles.lifetime
    height = height_after(age / fire.settings.fps, fire.profile.rise_speed)
    widening = np.maximum(taper(np.minimum(height, 1.4)), 0.2)
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    across = particles.x[alive] * cos + particles.z[alive] * sin
    nearness = particles.x[alive] * sin - particles.z[alive] * cos
    emphasis = np.exp(_FRONT_EMPHASIS * (nearness / np.abs(nearness).max(initial=1.0) - 1.0))
    lags = fire.slice_tracks[particles.slice[alive]] > 0
    merging = np.where(lags, 1 - smooth_step((height - _MERGING) / (_MERGED - _MERGING)), 1.0)
    weight = opacity(life) * emphasis * merging * particles.size[alive]
    visible = np.flatnonzero(weight > _MIN_WEIGHT * weight.max(initial=0.0))
    rows, columns = (-(-length // MASK_CELL) for length in grid.shape)
    size = particles.size[alive][visible] * (0.7 + 0.6 * life[visible])
    sigma_y = np.maximum(_BILLBOARD * grid.cells_per_height / MASK_CELL * size, 0.8)
    length = max(front.detail.correlation_length, _MIN_CORRELATION_LENGTH * grid.cells_per_half)
    sigma_x = np.maximum(0.3 * length / MASK_CELL * size, 0.8)
    y = (grid.rows_above - height[visible] * grid.cells_per_height) / MASK_CELL
    # Particles are placed in half widths of the front, columns in those of this view.
    ratio = front.half_width / half_width
    x = (grid.half_columns + (across * widening)[visible] * ratio * grid.cells_per_half) / MASK_CELL
    down = _gaussians(np.arange(rows) + 0.5, y, sigma_y) * weight[visible, None].astype(np.float32)
    right = _gaussians(np.arange(columns) + 0.5, x, sigma_x)
    return _Billboards(down, right, particles.slice[alive[visible]])


def _gaussians(
    at: NDArray[np.floating], middle: NDArray[np.floating], sigma: NDArray[np.floating]
) -> Plane:
    """Return Gaussians (n, len(at)) about each ``middle`` (n,), sampled at the points ``at``; they
    end at ``_CUT_OFF``."""
    distance = as_plane((at - middle[:, None]) / sigma[:, None])
    # Tails so small that they are denormal would slow the sums down many times.
    return as_plane(np.where(np.abs(distance) < _CUT_OFF, np.exp(-0.5 * distance * distance), 0))
