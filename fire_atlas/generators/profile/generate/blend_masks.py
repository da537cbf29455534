"""Blend masks: how much of each segment of the clip is seen at each place of a frame.

The mask of a segment is the sum of the billboards of its particles; near ones count more.
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
"""Side of the square of grid cells that share one weight of a mask."""

_FRONT_EMPHASIS = 5.0
"""Particles nearest to the camera weigh e to this power as much as those on the axis."""

_MIN_WEIGHT = 0.002
"""Minimum weight of a drawn particle, relative to the largest."""

_BILLBOARD = 0.16
"""Standard deviation of a particle's billboard, flame heights."""

_MIN_CORRELATION_LENGTH = 0.5
"""Minimum correlation length, in half widths of the foot, that sets the width of billboards."""


@dataclass(frozen=True, slots=True)
class BlendMask:
    """Blend mask of one segment of the clip, with the frames that the segment shows.

    Attributes:
        side: Index of the profile's side to which the clip belongs.
        frames: Numbers of two neighbouring frames of the clip, and weight of the second.
        mirrored: Whether the frames are mirrored left to right.
        weight: (r, c) float32, one for each square of ``MASK_CELL`` by ``MASK_CELL`` cells.
    """

    side: int
    frames: tuple[int, int, float]
    mirrored: bool
    weight: Plane


def blend_masks(
    fire: GeneratedFire, azimuth: float, half_width: float, taper: CubicSpline, time: float
) -> list[BlendMask]:
    """Return the masks of all segments visible at ``time``.

    Args:
        fire: The fire.
        azimuth: Direction of the camera, radians.
        half_width: Half width of the foot seen from that direction, flame heights.
        taper: Half width of the flame by height, in half widths of its foot.
        time: Time in frames of the fire's own time.
    """
    particles, grid, front = fire.particles, fire.profile.grid, fire.profile.front
    alive, age = particles.alive(time)
    life = age / particles.lifetime
    height = height_after(life * fire.rise_time, fire.profile.rise_speed)
    widening = np.maximum(taper(np.minimum(height, 1.4)), 0.2)
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    across = particles.x[alive] * cos + particles.z[alive] * sin
    nearness = particles.x[alive] * sin - particles.z[alive] * cos
    emphasis = np.exp(_FRONT_EMPHASIS * (nearness / np.abs(nearness).max(initial=1.0) - 1.0))
    weight = opacity(life) * emphasis
    weight *= particles.size[alive]
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
    return _summed_by_segment(fire, azimuth, time, alive[visible], down, right)


def _summed_by_segment(
    fire: GeneratedFire,
    azimuth: float,
    time: float,
    visible: NDArray[np.intp],
    down: Plane,
    right: Plane,
) -> list[BlendMask]:
    """Sum the billboards of the ``visible`` particles that show the same segment.

    The billboard of particle i is the outer product of ``down[i]`` (r,) and ``right[i]`` (c,). Sums
    are squared, which narrows the transition between two masks.
    """
    particles, period = fire.particles, fire.period
    behind = np.cos(fire.slice_azimuths - azimuth) < 0
    of_slice = particles.slice[visible]
    keys = (
        fire.slice_sides[of_slice], fire.slice_tracks[of_slice],
        fire.particle_segments[visible], behind[of_slice],
    )  # fmt: skip
    ranges = [int(key.max(initial=0)) + 1 for key in keys]
    kinds = np.ravel_multi_index(keys, ranges)
    masks = []
    for kind in np.unique(kinds):
        side, track, number, is_behind = (int(key) for key in np.unravel_index(kind, ranges))
        members = np.flatnonzero(kinds == kind)
        segment = fire.tracks[side][track][number]
        birth = float(particles.birth[visible[members[0]]])
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
    """Return Gaussians (n, len(at)) about each ``middle`` (n,), sampled at the points ``at``."""
    distance = (at - middle[:, None]) / sigma[:, None]
    return as_plane(np.exp(-0.5 * distance * distance))
