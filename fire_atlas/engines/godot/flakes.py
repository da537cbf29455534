"""Flake tracks as packed arrays, which scripts play in Godot: in a plane, or in space."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import StateGraph, StateTransition
from fire_atlas.core.decimals import table_text
from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH
from fire_atlas.effect.flakes.tracks import Tracks, as_drawn, by_column
from fire_atlas.formats.tracks.columns import DECIMALS, assert_finite, in_world

_DECIMALS = [
    DECIMALS["x"], DECIMALS["y"], 4, 4, DECIMALS["size"], DECIMALS["size"], DECIMALS["rotation"],
    DECIMALS["r"], DECIMALS["g"], DECIMALS["b"], DECIMALS["tail"],
]  # fmt: skip

_DECIMALS_IN_SPACE = [
    *[DECIMALS["x"]] * 3, 4, 4, 4, DECIMALS["size"], DECIMALS["size"],
    DECIMALS["r"], DECIMALS["g"], DECIMALS["b"], DECIMALS["tail"],
]  # fmt: skip

_FAINTEST = 1e-4
"""Light, linear, below which players draw no halo."""

_SAME = 0.01
"""Largest distance, px, from where a flake was to be to that which is the same elsewhere."""


@dataclass(frozen=True, slots=True)
class FlakeArrays:
    """The flakes of all animations, one after the other.

    Attributes:
        begins: Number of the first frame of each animation, and last the number of all frames.
        loops: Whether frame 0 of an animation follows its last one, 1 or 0.
        rounds: Number of rounds of each animation that its frames cover.
        hard: Whether the flakes of an animation are squares that move once a frame, 1 or 0.
        first: Index of the first row of each frame, and last the number of all rows.
        next: Index of the row of the same flake in the following frame, -1 if there is none. After
            the last frame of what plays once that is one of the animation that it leads to.
        rows: (rows, 11) position x, y from the pivot, px, y down; displacement to the next frame
            dx, dy, px; length and width, px; rotation, rad, clockwise on screen; linear light
            r, g, b at the head; light at the tail relative to that.
        cells: For each row the index of the cell of a texture that it shows, -1 without one; empty
            if no cells are played.
        most: Largest number of rows of a frame.
        bounds: (x, y, width, height) around all flakes, px from the pivot.
        decimals: Of each number of a row.
    """

    begins: list[int]
    loops: list[int]
    rounds: list[int]
    hard: list[int]
    first: list[int]
    next: list[int]
    rows: NDArray[np.float64]
    cells: list[int]
    most: int
    bounds: tuple[int, int, int, int]
    decimals: Sequence[int] = tuple(_DECIMALS)

    def rows_text(self) -> str:
        """Return ``rows`` as text, one line per row."""
        return table_text(self.rows, self.decimals, "", ", ", ",\n").decode().removesuffix(",\n")


def flake_arrays(
    tracks: Mapping[str, Sequence[Tracks]],
    pivots: Mapping[str, tuple[float, float]],
    names: Sequence[str] = (),
    graph: StateGraph | None = None,
) -> FlakeArrays:
    """Return the arrays of flakes.

    Args:
        tracks: By animation, every set of its flakes; these follow one another.
        pivots: The pivot of each animation, px.
        names: Of the cells of textures that can be played, in the order of their indices.
        graph: How the animations lead to one another, if they do.
    """
    begins, first, following = [0], [0], list[int]()
    begins_of = dict[str, list[int]]()
    index = {name: i for i, name in enumerate(names)}
    cells = list[int]()
    tables = []
    for name, recorded in _named_sets(tracks):
        assert_finite(recorded)
        drawn = as_drawn(recorded)
        counts = [len(frame) for frame in drawn.frames]
        rows_after = drawn.following_rows()
        following += np.where(rows_after < 0, -1, first[-1] + rows_after).tolist()
        begins_of.setdefault(name, []).append(begins[-1])
        first += [first[-1] + int(end) for end in np.cumsum(counts)]
        begins.append(len(first) - 1)
        tables += [_rows(frame, drawn, pivots[name]) for frame in drawn.frames]
        cells += _cells(drawn, index)
    for way in graph.transitions if graph else ():
        here, there = (
            [*zip(tracks[n], begins_of[n], strict=True)] for n in (way.before, way.after)
        )
        for (before, begin), (after, entry) in zip(here, there, strict=True):
            if not before.loop:
                row, entered = first[begin + way.frame], first[entry + way.entry]
                rows_after = _rows_after(before, after, way, entered)
                following[row : row + len(rows_after)] = rows_after.tolist()
    rows = np.concatenate(tables)
    return FlakeArrays(
        begins=begins,
        loops=[int(flown.loop) for _, flown in _named_sets(tracks)],
        rounds=[flown.rounds for _, flown in _named_sets(tracks)],
        hard=[int(flown.hard) for _, flown in _named_sets(tracks)],
        first=first,
        next=following,
        rows=rows,
        cells=cells if names else [],
        most=int(np.diff(first).max()),
        bounds=_bounds(rows, np.array(cells) >= 0),
    )


def _named_sets(tracks: Mapping[str, Sequence[Tracks]]) -> list[tuple[str, Tracks]]:
    """Return each set of flakes with the name of its animation."""
    return [(name, flown) for name, sets in tracks.items() for flown in sets]


def _rows_after(
    before: Tracks, after: Tracks, way: StateTransition, first: int
) -> NDArray[np.int64]:
    """Return the index of the same flake, or -1, for each row of the frame ``before`` a transition;
    ``first`` is that of the first row of the frame ``after`` it."""
    here, there = by_column(before.frames[way.frame]), by_column(after.frames[way.entry])
    from scipy.spatial import KDTree

    if not len(there["x"]):
        return np.full(len(here["x"]), -1)
    ahead = np.column_stack([here[axis] + here[f"v{axis}"] / before.fps for axis in "xy"])
    off, nearest = KDTree(np.column_stack([there["x"], there["y"]])).query(ahead)
    return np.where(off < _SAME, first + nearest, -1)


def _cells(tracks: Tracks, index: Mapping[str, int]) -> list[int]:
    """Return the index of the cell that each row of all frames shows, -1 without a texture."""
    texture = tracks.texture
    if texture is None or not index:
        return [-1] * sum(map(len, tracks.frames))
    return [index[texture.frames[cell]] for cell in np.concatenate(texture.cells).tolist()]


def _rows(
    frame: NDArray[np.float64], tracks: Tracks, pivot: tuple[float, float]
) -> NDArray[np.float64]:
    column = by_column(frame)
    size = column["size"]
    light = (column[name] * column["a"] for name in "rgb")
    return np.column_stack([
        column["x"] - pivot[0], column["y"] - pivot[1],
        column["vx"] / tracks.fps, column["vy"] / tracks.fps,
        size * column["stretch"], size, column["rotation"], *light, column["tail"],
    ])  # fmt: skip


def _bounds(rows: NDArray[np.float64], has_corners: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return the box around all flakes; those of a texture reach to the corners of a rectangle."""
    if not len(rows):
        return 0, 0, 0, 0
    halo = rows[:, 7:10].max(axis=1) * HALO_LIGHT > _FAINTEST
    margin = np.where(halo, (HALO_WIDTH - 1) * rows[:, 5] / 2, 0)
    length = np.where(has_corners, np.hypot(rows[:, 4], rows[:, 5]), rows[:, 4])
    extent = length / 2 + margin + np.abs(rows[:, 2:4]).max(axis=1)
    low = [int(np.floor((rows[:, axis] - extent).min())) for axis in (0, 1)]
    high = [int(np.ceil((rows[:, axis] + extent).max())) for axis in (0, 1)]
    return low[0], low[1], high[0] - low[0], high[1] - low[1]


def flake_arrays_in_space(
    tracks: Mapping[str, Sequence[Tracks]], graph: StateGraph | None = None
) -> FlakeArrays:
    """Return the arrays of ``tracks`` of a fire with depth, as seen by any camera, without cells.

    Rows have 12 numbers: position x, y, z from the middle of the fire on the ground, px, y up and
    z towards the front; displacement to the next frame dx, dy, dz, px; length of the streak along
    it, less its ends, and width, px; linear light r, g, b at the head; light at the tail relative
    to that. ``bounds`` has the size of a cube around the origin that holds all flakes.
    """
    arrays = flake_arrays(tracks, dict.fromkeys(tracks, (0.0, 0.0)), graph=graph)
    sets = _named_sets(tracks)
    tables = [_rows_in_space(rows, flown) for _, flown in sets for rows in flown.frames]
    rows = np.concatenate(tables)
    return replace(arrays, rows=rows, bounds=_cube(rows), decimals=_DECIMALS_IN_SPACE)


def _rows_in_space(frame: NDArray[np.float64], tracks: Tracks) -> NDArray[np.float64]:
    """Return rows in the axes of the world: right of the front, up, and towards it."""
    camera, column = tracks.camera, by_column(frame)
    if camera is None:
        raise ValueError("the fire is flat")
    place, velocity, width = (length * tracks.height for length in in_world(tracks, column))
    right, up = camera.origin[0] - tracks.width / 2, tracks.height - camera.origin[1]
    axes = camera.axes() * np.array([[1], [-1], [-1]])  # right, up, towards the camera
    world = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    place = (place - [right, up, 0]) @ axes @ world.T
    way = velocity @ axes @ world.T / tracks.fps
    # The streak is along the way: as much of it as the streak in the view is of the way there.
    seen = np.hypot(column["vx"], column["vy"]) / tracks.fps
    share = column["size"] * (column["stretch"] - 1) / np.maximum(seen, 1e-6)
    streak = np.where(seen > 1e-3, share, 0) * np.sqrt((way * way).sum(axis=1))
    light = (column[name] * column["a"] for name in "rgb")
    return np.column_stack([place, way, streak, width, *light, column["tail"]])


def _cube(rows: NDArray[np.float64]) -> tuple[int, int, int, int]:
    reach = np.abs(rows[:, :3]) + np.abs(rows[:, 3:6]) + rows[:, 6:8].sum(axis=1, keepdims=True)
    side = 2 * math.ceil(reach.max(initial=0))
    return -side // 2, -side // 2, side, side
