"""Flake tracks: what every flake does in every frame, as tables."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

COLUMNS = (
    "id", "x", "y", "vx", "vy", "size", "stretch", "rotation", "r", "g", "b", "a", "age", "life",
)  # fmt: skip
"""Columns of ``Tracks.frames``. px, px/s, s, rad; rgb linear light, may exceed 1."""

SPAWN_COLUMNS = ("id", "t", "life", "x", "y", "vx", "vy", "size", "wraps")
"""Columns of ``Tracks.spawns``. px, px/s, s; ``wraps`` 0 or 1."""

RowNumbers = tuple[NDArray[np.int64], ...]
"""A number for each row of each frame: (rows,) a frame."""

_SEEN = 0.001
"""Light that is next to none: 3 of 255 in sRGB."""


@dataclass(frozen=True, slots=True)
class Tracks:
    """All flakes of a build.

    A flake is drawn as the additive soft sprite (1 - q²)², q² = (2a/(size·stretch))² + (2b/size)²,
    with a along ``rotation`` (clockwise from +x on screen) and b across it, in px from (x, y);
    its light at the centre is rgb·a, linear. Or as a hard square of ``size`` whole px, all of it
    that bright, at the px nearest to its place.

    A flight is the unbroken life of one flake, from the first frame that shows it to the last. In a
    loop it goes on from the last frame into frame 0. A loop that is not longer than a flight shows
    several of its moments in a frame: the flake changes its id on the way, so that no id is in a
    frame twice (``wrapping.wrapped``).

    Attributes:
        fps: Frames per second of the animation.
        width, height: Frame size, px.
        loop: Whether frame 0 follows the last frame.
        seed: The recipe's seed.
        spawns: (ids, 9) float64, columns ``SPAWN_COLUMNS``, by id.
        frames: One (rows, 14) float64 table a frame, columns ``COLUMNS``, by id.
        flights: Which flight each row belongs to, (rows,) a frame: the first id of its flake.
        moments: Where in its flight each row is, (rows,) a frame: frames since the flight began.
        hard: Whether flakes are squares.
    """

    fps: float
    width: int
    height: int
    loop: bool
    seed: int
    spawns: NDArray[np.float64]
    frames: tuple[NDArray[np.float64], ...]
    flights: RowNumbers
    moments: RowNumbers
    hard: bool = False

    @classmethod
    def once(
        cls,
        fps: float,
        size: tuple[int, int],
        seed: int,
        spawns: NDArray[np.float64],
        frames: Sequence[NDArray[np.float64]],
        hard: bool = False,
    ) -> Self:
        """Return tracks that play once: each id is one flight, in frames that follow one another.

        ``size`` is the width and height of a frame, px; the rest as the attributes.
        """
        flights = tuple(rows[:, 0].astype(np.int64) for rows in frames)
        moments = _moments(flights)
        return cls(fps, *size, False, seed, spawns, tuple(frames), flights, moments, hard)


def _moments(flights: RowNumbers) -> RowNumbers:
    """Return how many frames each row comes after the first of its flight."""
    counts = [len(rows) for rows in flights]
    frame = np.repeat(np.arange(len(counts)), counts)
    _, first, flight = np.unique(np.concatenate(flights), return_index=True, return_inverse=True)
    return tuple(np.split(frame - frame[first][flight], np.cumsum(counts)[:-1]))


def glowing(rows: NDArray[np.float64]) -> int:
    """Return how many flakes of a frame's table can be seen."""
    column = dict(zip(COLUMNS, rows.T, strict=True))
    brightest = np.maximum.reduce([column["r"], column["g"], column["b"]]) * column["a"]
    return int(np.count_nonzero(brightest > _SEEN))


def first_frames(tracks: Tracks, count: int) -> Tracks:
    """Tracks of the first ``count`` frames, and of the flakes that are seen there."""
    frames = tracks.frames[:count]
    seen = np.isin(tracks.spawns[:, 0], np.concatenate([rows[:, 0] for rows in frames]))
    return replace(
        tracks,
        spawns=tracks.spawns[seen],
        frames=frames,
        flights=tracks.flights[:count],
        moments=tracks.moments[:count],
    )


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
