"""Flake tracks: what every flake does in every frame, as tables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

COLUMNS = (
    "id", "x", "y", "vx", "vy", "size", "stretch", "rotation", "r", "g", "b", "a", "age", "life",
)  # fmt: skip
"""Columns of ``Tracks.frames``. px, px/s, s, rad; rgb linear light, may exceed 1."""

SPAWN_COLUMNS = ("id", "t", "life", "x", "y", "vx", "vy", "size", "wraps")
"""Columns of ``Tracks.spawns``. px, px/s, s; ``wraps`` 0 or 1."""


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
