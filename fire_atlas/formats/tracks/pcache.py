"""Flakes as a point cache of Unity's VFX Graph: the births, for a graph that emits them again.

A point cache is one still set of points, so it holds the spawn table; the graph flies the flakes.
The importer reads lines that end in LF alone, knows ``float`` and keeps it as half precision.
"""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from fire_atlas.formats.decimals import plain, table_text
from fire_atlas.formats.tracks.columns import DECIMALS, assert_finite
from fire_atlas.formats.tracks.names import flakes_file
from fire_atlas.formats.tracks.world import AXES, METRES, SPEED, place, velocity

_PROPERTIES = {
    **{f"position.{axis}": METRES for axis in "xyz"},
    **{f"velocity.{axis}": SPEED for axis in "xyz"},
    **{f"color.{channel}": DECIMALS[channel] for channel in "rgba"},
    "size": METRES,
    "angle": 3,
    "lifetime": DECIMALS["life"],
    "spawnTime": DECIMALS["t"],
    "flakeId": 0,
}
"""Properties of a point, each with its decimals."""

_WHOLE = 2048
"""Half precision tells whole numbers apart up to here."""


def write_tracks_pcache(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.pcache``: a point for each birth, in the order of the JSON's spawns.

    ``angle`` is that of the velocity, degrees, counter-clockwise from +x, as Unity turns about z;
    ``color`` that of the flake where it shines brightest, linear light that may exceed 1;
    ``flakeId`` the JSON's id modulo 2048. ``spawnTime`` is negative for a further round of a flake
    that outlives its loop, which a graph that plays the loop again and again has by itself.
    """
    assert_finite(tracks)
    points = table_text(_points(tracks), list(_PROPERTIES.values()), "", " ", "\n")
    seconds = plain(len(tracks.frames) / tracks.fps, DECIMALS["t"])
    header = (
        "pcache",
        "format ascii 1.0",
        f"comment flakes of {name}, one point a birth, by fire-atlas",
        f"comment {AXES}; frame {plain(tracks.width / tracks.height, METRES)} m x 1 m",
        "comment velocity m/s, lifetime and spawnTime s, angle degrees counter-clockwise from +x",
        f"comment plays {seconds} s, {'in a loop' if tracks.loop else 'once'}",
        f"elements {len(tracks.spawns)}",
        *(f"property float {name}" for name in _PROPERTIES),
        "end_header",
    )
    data = "".join(f"{line}\n" for line in header).encode("ascii") + points
    return OutputFile(flakes_file(name, "pcache"), "tracks", data)


def _points(tracks: Tracks) -> NDArray[np.float64]:
    """Return (births, 15), columns as ``_PROPERTIES``."""
    birth = dict(zip(SPAWN_COLUMNS, tracks.spawns.T, strict=True))
    return np.column_stack([
        place(tracks, birth["x"], birth["y"]),
        velocity(tracks, birth["vx"], birth["vy"]),
        _brightest(tracks),
        birth["size"] / tracks.height,
        np.degrees(np.arctan2(-birth["vy"], birth["vx"])),
        birth["life"],
        birth["t"],
        birth["id"] % _WHOLE,
    ])  # fmt: skip


def _brightest(tracks: Tracks) -> NDArray[np.float64]:
    """Return the light and opacity (births, 4) of each flake where its opacity is highest."""
    rows = np.concatenate([np.zeros((0, len(COLUMNS))), *tracks.frames])
    rows = rows[np.lexsort((-rows[:, COLUMNS.index("a")], rows[:, 0]))]
    ids, first = np.unique(rows[:, 0], return_index=True)
    light = np.zeros((len(tracks.spawns), 4))
    _, birth, row = np.intersect1d(tracks.spawns[:, 0], ids, return_indices=True)
    light[birth] = rows[first[row]][:, [COLUMNS.index(name) for name in "rgba"]]
    return light
