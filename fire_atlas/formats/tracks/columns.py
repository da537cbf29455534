"""What all text forms of flake tracks share: how exactly their numbers are written."""

import numpy as np

from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks

DECIMALS = {
    "id": 0, "t": 6, "x": 3, "y": 3, "vx": 2, "vy": 2, "size": 3, "stretch": 3, "rotation": 4,
    "r": 4, "g": 4, "b": 4, "a": 4, "age": 3, "life": 3, "wraps": 0,
}  # fmt: skip
"""Decimals of each column of ``Tracks``, the same in every format. 0: an integer."""


def frame_time(tracks: Tracks, frame: int) -> float:
    """Return when a frame begins, s, rounded as it is written."""
    return round(frame / tracks.fps, DECIMALS["t"])


def assert_finite(tracks: Tracks) -> None:
    """Refuse NaN and infinities, which no JSON can hold: they are a fault of the simulation."""
    tables = {"spawns": tracks.spawns} | {f"frame {i}": t for i, t in enumerate(tracks.frames)}
    for where, table in tables.items():
        if not np.isfinite(table).all():
            row, column = np.argwhere(~np.isfinite(table))[0]
            name = (SPAWN_COLUMNS if where == "spawns" else COLUMNS)[column]
            raise AssertionError(f"tracks, {where}, row {row}: {name} is {table[row, column]}")
