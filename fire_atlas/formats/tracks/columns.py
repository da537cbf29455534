"""Decimals, times and world coordinates of flake tracks, as the file formats write them.

World coordinates are those of point caches: m, x right, y up, z towards the viewer. The frame
stands upright, 1 m high, with the middle of its bottom edge at the origin.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Values
from fire_atlas.effect.flakes.tracks import Tracks

DECIMALS = {
    "id": 0, "t": 6, "x": 3, "y": 3, "vx": 2, "vy": 2, "size": 3, "stretch": 3, "rotation": 4,
    "r": 5, "g": 5, "b": 5, "a": 6, "age": 3, "life": 3, "kind": 0, "blur": 3, "tail": 3,
    "wraps": 0, "cell": 0, "z": 3, "vz": 2,
}  # fmt: skip
"""Decimals of each column of ``Tracks``, the same in every format. 0: an integer."""

CELL = "cell"
"""Column of the cell of the texture that a flake shows, after all others; only with a texture."""

AXES = "metres, x right, y up; one frame height is 1 m; origin: middle of the frame's bottom edge"

POSITION_DECIMALS = 6
"""Decimals of positions and sizes, m."""
VELOCITY_DECIMALS = 5
"""Decimals of velocities, m/s."""


def frame_time(tracks: Tracks, frame: int) -> float:
    """Return the time at which a frame begins, s, rounded as the column ``t``."""
    return round(frame / tracks.fps, DECIMALS["t"])


def columns_with_cells(tracks: Tracks) -> tuple[str, ...]:
    """Return the columns of ``rows_with_cells``."""
    return tracks.columns if tracks.texture is None else (*tracks.columns, CELL)


def rows_with_cells(tracks: Tracks, frame: int) -> NDArray[np.float64]:
    """Return the rows of a frame, with the column ``CELL`` if their flakes have a texture."""
    rows = tracks.frames[frame]
    return rows if tracks.texture is None else np.column_stack([rows, tracks.texture.cells[frame]])


def assert_finite(tracks: Tracks) -> None:
    """Raise AssertionError for NaN or infinity, which only a bug in the simulation can cause."""
    tables = {"spawns": tracks.spawns} | {f"frame {i}": t for i, t in enumerate(tracks.frames)}
    for where, table in tables.items():
        if not np.isfinite(table).all():
            row, column = np.argwhere(~np.isfinite(table))[0]
            name = (tracks.spawn_columns if where == "spawns" else tracks.columns)[column]
            raise AssertionError(f"tracks, {where}, row {row}: {name} is {table[row, column]}")


def in_world(
    tracks: Tracks, row: Mapping[str, Values]
) -> tuple[NDArray[np.float64], NDArray[np.float64], Values]:
    """Return positions (n, 3), m, velocities (n, 3), m/s, and widths (n,), m, in the world.

    Flakes of a flat clip are in the plane of the frame. What a camera's perspective does is undone:
    the axes are those of the camera, but lines of sight are parallel.

    Args:
        tracks: The tracks.
        row: Columns (n,) of flakes: x, y, vx, vy, size, and z, vz if the fire has depth.
    """
    still = np.zeros_like(row["x"])
    z, vz = row.get("z", still), row.get("vz", still)
    camera = tracks.camera
    away = math.inf if camera is None else camera.distance * camera.scale
    nearness = 1 - z / away
    position, velocity = [], []
    for axis, length in (("x", tracks.width), ("y", tracks.height)):
        aside = row[axis] - length / 2
        position.append(aside * nearness)
        velocity.append(row[f"v{axis}"] * nearness - aside * vz / away)
    (right, down), (vx, vy) = position, velocity
    height = tracks.height
    return (
        np.column_stack([right, height / 2 - down, z]) / height,
        np.column_stack([vx, -vy, vz]) / height,
        row["size"] * nearness / height,
    )
