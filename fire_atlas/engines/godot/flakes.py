"""Flake tracks as packed arrays, which a script plays in Godot."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks, as_drawn
from fire_atlas.formats.decimals import table_text
from fire_atlas.formats.tracks.columns import DECIMALS, assert_finite

_DECIMALS = [
    DECIMALS["x"], DECIMALS["y"], 4, 4, DECIMALS["size"], DECIMALS["size"], DECIMALS["rotation"],
    DECIMALS["r"], DECIMALS["g"], DECIMALS["b"], DECIMALS["tail"],
]  # fmt: skip

_FAINTEST = 1e-4
"""Light, linear, below which players draw no halo."""


@dataclass(frozen=True, slots=True)
class FlakeArrays:
    """The flakes of all animations, one after the other.

    Attributes:
        begins: Number of the first frame of each animation, and last the number of all frames.
        loops: Whether frame 0 of an animation follows its last one, 1 or 0.
        rounds: Number of rounds of each animation that its frames cover.
        hard: Whether the flakes of an animation are squares that move once a frame, 1 or 0.
        first: Index of the first row of each frame, and last the number of all rows.
        next: Index of the row of the same flake in the following frame, -1 if there is none.
        rows: (rows, 11) position x, y from the pivot, px, y down; displacement to the next frame
            dx, dy, px; length and width, px; rotation, rad, clockwise on screen; linear light
            r, g, b at the head; light at the tail relative to that.
        most: Largest number of rows of a frame.
        bounds: (x, y, width, height) around all flakes, px from the pivot.
    """

    begins: list[int]
    loops: list[int]
    rounds: list[int]
    hard: list[int]
    first: list[int]
    next: list[int]
    rows: NDArray[np.float64]
    most: int
    bounds: tuple[int, int, int, int]

    def rows_text(self) -> str:
        """Return ``rows`` as text, one line per row."""
        return table_text(self.rows, _DECIMALS, "", ", ", ",\n").decode().removesuffix(",\n")


def flake_arrays(
    tracks: Mapping[str, Tracks], pivots: Mapping[str, tuple[float, float]]
) -> FlakeArrays:
    """Return the arrays of ``tracks``; ``pivots`` has the pivot of each animation, px."""
    begins, first, following = [0], [0], list[int]()
    tables = []
    for name, recorded in tracks.items():
        assert_finite(recorded)
        each = as_drawn(recorded)
        counts = [len(frame) for frame in each.frames]
        rows_after = each.following_rows()
        following += np.where(rows_after < 0, -1, first[-1] + rows_after).tolist()
        first += [first[-1] + int(end) for end in np.cumsum(counts)]
        begins.append(len(first) - 1)
        tables += [_rows(frame, each, pivots[name]) for frame in each.frames]
    rows = np.concatenate(tables)
    return FlakeArrays(
        begins=begins,
        loops=[int(each.loop) for each in tracks.values()],
        rounds=[each.rounds for each in tracks.values()],
        hard=[int(each.hard) for each in tracks.values()],
        first=first,
        next=following,
        rows=rows,
        most=int(np.diff(first).max()),
        bounds=_bounds(rows),
    )


def _rows(
    frame: NDArray[np.float64], tracks: Tracks, pivot: tuple[float, float]
) -> NDArray[np.float64]:
    column = dict(zip(COLUMNS, frame.T, strict=True))
    size = column["size"]
    light = (column[name] * column["a"] for name in "rgb")
    return np.column_stack([
        column["x"] - pivot[0], column["y"] - pivot[1],
        column["vx"] / tracks.fps, column["vy"] / tracks.fps,
        size * column["stretch"], size, column["rotation"], *light, column["tail"],
    ])  # fmt: skip


def _bounds(rows: NDArray[np.float64]) -> tuple[int, int, int, int]:
    if not len(rows):
        return 0, 0, 0, 0
    halo = rows[:, 7:10].max(axis=1) * HALO_LIGHT > _FAINTEST
    margin = np.where(halo, (HALO_WIDTH - 1) * rows[:, 5] / 2, 0)
    extent = rows[:, 4] / 2 + margin + np.abs(rows[:, 2:4]).max(axis=1)
    low = [int(np.floor((rows[:, axis] - extent).min())) for axis in (0, 1)]
    high = [int(np.ceil((rows[:, axis] + extent).max())) for axis in (0, 1)]
    return low[0], low[1], high[0] - low[0], high[1] - low[1]
