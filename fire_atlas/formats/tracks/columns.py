"""Decimals, times and world coordinates of flake tracks, as the file formats write them.

World coordinates are those of point caches: m, x right, y up, z towards the viewer. The frame
stands upright, 1 m high, with the middle of its bottom edge at the origin.
"""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks

DECIMALS = {
    "id": 0, "t": 6, "x": 3, "y": 3, "vx": 2, "vy": 2, "size": 3, "stretch": 3, "rotation": 4,
    "r": 5, "g": 5, "b": 5, "a": 5, "age": 3, "life": 3, "kind": 0, "blur": 3, "tail": 3,
    "wraps": 0,
}  # fmt: skip
"""Decimals of each column of ``Tracks``, the same in every format. 0: an integer."""


AXES = "metres, x right, y up; one frame height is 1 m; origin: middle of the frame's bottom edge"

POSITION_DECIMALS = 6
"""Decimals of positions and sizes, m."""
VELOCITY_DECIMALS = 5
"""Decimals of velocities, m/s."""


def frame_time(tracks: Tracks, frame: int) -> float:
    """Return the time at which a frame begins, s, rounded as the column ``t``."""
    return round(frame / tracks.fps, DECIMALS["t"])


def assert_finite(tracks: Tracks) -> None:
    """Raise AssertionError for NaN or infinity, which only a bug in the simulation can cause."""
    tables = {"spawns": tracks.spawns} | {f"frame {i}": t for i, t in enumerate(tracks.frames)}
    for where, table in tables.items():
        if not np.isfinite(table).all():
            row, column = np.argwhere(~np.isfinite(table))[0]
            name = (SPAWN_COLUMNS if where == "spawns" else COLUMNS)[column]
            raise AssertionError(f"tracks, {where}, row {row}: {name} is {table[row, column]}")


def world_position(
    tracks: Tracks, x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Convert x and y (n,) in the frame, px, y down, to positions in the world (n, 3), m."""
    right, up = (x - tracks.width / 2) / tracks.height, 1 - y / tracks.height
    return np.column_stack([right, up, np.zeros_like(right)])


def world_velocity(
    tracks: Tracks, vx: NDArray[np.float64], vy: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Convert vx and vy (n,), px/s, y down, to velocities in the world (n, 3), m/s."""
    return np.column_stack([vx, -vy, np.zeros_like(vx)]) / tracks.height
