"""Write flake spawns as a point cache for Unity's VFX Graph, which simulates the flakes itself.

A point cache is one set of points without frames, so it holds the table of spawns. Unity's importer
needs lines that end in LF and properties of type ``float``, which it stores in half precision.
"""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.decimals import plain, table_text
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from fire_atlas.formats.output_names import flakes_file
from fire_atlas.formats.tracks.columns import (
    AXES,
    CELL,
    DECIMALS,
    POSITION_DECIMALS,
    VELOCITY_DECIMALS,
    assert_finite,
    in_world,
)

_PROPERTIES = {
    **{f"position.{axis}": POSITION_DECIMALS for axis in "xyz"},
    **{f"velocity.{axis}": VELOCITY_DECIMALS for axis in "xyz"},
    **{f"color.{channel}": DECIMALS[channel] for channel in "rgba"},
    "size": POSITION_DECIMALS,
    "angle": 3,
    "lifetime": DECIMALS["life"],
    "spawnTime": DECIMALS["t"],
    "flakeId": 0,
}
"""Decimals of each property of a point. With a texture there is one more, ``CELL``."""

_MAX_EXACT_ID = 2048
"""Half precision represents all integers up to here exactly."""


def write_tracks_pcache(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.pcache``: a point for each spawn, in the order of the JSON's spawns.

    ``angle`` is the direction of the velocity, degrees counter-clockwise from +x, as Unity rotates
    about z; ``color`` the linear light at the flake's brightest, which may exceed 1; ``flakeId``
    the JSON's id modulo 2048; ``cell``, with a texture, the index of the first one it shows.
    Points with a negative ``spawnTime`` are flakes of an earlier round of the loop that are still
    alive: a graph that repeats the loop must skip them.
    """
    assert_finite(tracks)
    properties = {**_PROPERTIES, **({} if tracks.texture is None else {CELL: DECIMALS[CELL]})}
    points = table_text(_points(tracks), list(properties.values()), "", " ", "\n")
    seconds = plain(len(tracks.frames) / tracks.fps, DECIMALS["t"])
    header = (
        "pcache",
        "format ascii 1.0",
        f"comment flakes of {name}, one point a birth, by fire-atlas",
        f"comment {AXES}; frame {plain(tracks.width / tracks.height, POSITION_DECIMALS)} m x 1 m",
        "comment velocity m/s, lifetime and spawnTime s, angle degrees counter-clockwise from +x",
        f"comment plays {seconds} s, {'in a loop' if tracks.loop else 'once'}",
        f"elements {len(tracks.spawns)}",
        *(f"property float {name}" for name in properties),
        "end_header",
    )
    data = "".join(f"{line}\n" for line in header).encode("ascii") + points
    return OutputFile(flakes_file(name, "pcache"), "tracks", data)


def _points(tracks: Tracks) -> NDArray[np.float64]:
    """Return (spawns, 15 or, with a texture, 16), columns as the properties."""
    spawn = dict(zip(tracks.spawn_columns, tracks.spawns.T, strict=True))
    position, velocity, width = in_world(tracks, spawn)
    return np.column_stack([
        position,
        velocity,
        _brightest(tracks),
        width,
        np.degrees(np.arctan2(velocity[:, 1], velocity[:, 0])),
        spawn["life"],
        spawn["t"],
        spawn["id"] % _MAX_EXACT_ID,
        *_first_cells(tracks),
    ])  # fmt: skip


def _first_cells(tracks: Tracks) -> list[NDArray[np.int64]]:
    """Return the cell (spawns,) that each flake shows when it is youngest; none without one."""
    if tracks.texture is None:
        return []
    rows, cells = np.concatenate(tracks.frames), np.concatenate(tracks.texture.cells)
    order = np.lexsort((rows[:, COLUMNS.index("age")], rows[:, 0]))
    ids, first = np.unique(rows[order, 0], return_index=True)
    return [cells[order[first[np.searchsorted(ids, tracks.spawns[:, 0])]]]]


def _brightest(tracks: Tracks) -> NDArray[np.float64]:
    """Return light and opacity (spawns, 4) of each flake when its opacity is highest."""
    rows = np.concatenate([np.zeros((0, len(tracks.columns))), *tracks.frames])
    rows = rows[np.lexsort((-rows[:, COLUMNS.index("a")], rows[:, 0]))]
    ids, first = np.unique(rows[:, 0], return_index=True)
    light = np.zeros((len(tracks.spawns), 4))
    _, spawn, row = np.intersect1d(tracks.spawns[:, 0], ids, return_indices=True)
    light[spawn] = rows[first[row]][:, [COLUMNS.index(name) for name in "rgba"]]
    return light
