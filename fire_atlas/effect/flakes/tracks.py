"""Flake tracks: what every flake does in every frame, as tables."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

COLUMNS = (
    "id", "x", "y", "vx", "vy", "size", "stretch", "rotation", "r", "g", "b", "a", "age", "life",
)  # fmt: skip
"""Columns of ``Tracks.frames``. px, px/s, s, rad; rgb linear light, may exceed 1."""

SPAWN_COLUMNS = ("id", "t", "life", "x", "y", "vx", "vy", "size", "wraps")
"""Columns of ``Tracks.spawns``. px, px/s, s; ``wraps`` 0 or 1."""

_SEEN = 0.001
"""Light that is next to none: 3 of 255 in sRGB."""


@dataclass(frozen=True, slots=True)
class Tracks:
    """All flakes of a build.

    A flake is drawn as the additive soft sprite (1 - q²)², q² = (2a/(size·stretch))² + (2b/size)²,
    with a along ``rotation`` (clockwise from +x on screen) and b across it, in px from (x, y);
    its light at the centre is rgb·a, linear. Or as a hard square of ``size`` whole px, all of it
    that bright, at the px nearest to its place.

    Attributes:
        fps: Frames per second of the animation.
        width, height: Frame size, px.
        loop: Whether frame 0 follows the last frame.
        seed: The recipe's seed.
        spawns: (flakes, 9) float64, columns ``SPAWN_COLUMNS``, by id.
        frames: One (rows, 14) float64 table a frame, columns ``COLUMNS``, by id.
        hard: Whether flakes are squares.
    """

    fps: float
    width: int
    height: int
    loop: bool
    seed: int
    spawns: NDArray[np.float64]
    frames: tuple[NDArray[np.float64], ...]
    hard: bool = False


def glowing(rows: NDArray[np.float64]) -> int:
    """Return how many flakes of a frame's table can be seen."""
    column = dict(zip(COLUMNS, rows.T, strict=True))
    brightest = np.maximum.reduce([column["r"], column["g"], column["b"]]) * column["a"]
    return int(np.count_nonzero(brightest > _SEEN))


def first_frames(tracks: Tracks, count: int) -> Tracks:
    """Tracks of the first ``count`` frames, and of the flakes that are seen there."""
    frames = tracks.frames[:count]
    seen = np.isin(tracks.spawns[:, 0], np.concatenate([rows[:, 0] for rows in frames]))
    return replace(tracks, frames=frames, spawns=tracks.spawns[seen])


def as_drawn(tracks: Tracks) -> Tracks:
    """Tracks with hard flakes where they are drawn: on whole px, upright, still for a frame.

    Soft flakes are drawn where they are.
    """
    return replace(tracks, frames=tuple(map(_snapped, tracks.frames))) if tracks.hard else tracks


def _snapped(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    column = dict(zip(COLUMNS, rows.T, strict=True))
    half, still = column["size"] / 2, np.zeros(len(rows))
    column |= {axis: np.rint(column[axis] - half) + half for axis in "xy"}
    column |= dict.fromkeys(("vx", "vy", "rotation"), still)
    return np.stack([column[name] for name in COLUMNS]).T
