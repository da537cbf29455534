"""Write flake tracks as Houdini's point cache in JSON, for the plugin HoudiniNiagara in Unreal.

Niagara spawns a point when its id first appears and keeps it for its lifetime, so the frames of an
id must follow one another: a flake that flies on from a loop's last frame into its first gets a
second id there. An empty frame is added at the end, because a point that is alive in the last frame
of a cache would never die.
"""

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.decimals import table_text
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.tracks import Tracks, by_column
from fire_atlas.formats.output_names import flakes_file
from fire_atlas.formats.tracks.columns import (
    CELL,
    DECIMALS,
    POSITION_DECIMALS,
    VELOCITY_DECIMALS,
    assert_finite,
    frame_time,
    in_world,
)

_ATTRIBUTES = {"id": 1, "P": 3, "v": 3, "Cd": 3, "alpha": 1, "pscale": 1, "age": 1, "life": 1}
"""Attributes of a point, with their number of components."""

_CELL = {"cell": 1}
"""The attribute that flakes with a texture have besides."""

_DECIMALS = [
    0, *[POSITION_DECIMALS] * 3, *[VELOCITY_DECIMALS] * 3,
    *(DECIMALS[channel] for channel in "rgba"),
    POSITION_DECIMALS, DECIMALS["age"], DECIMALS["life"],
]  # fmt: skip
_ID, _AGE, _LIFE = 0, 12, 13

_Rows = NDArray[np.float64]
"""(points, 14 or, with a texture, 15), columns as the attributes."""


def write_tracks_hjson(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.hjson``: each flake in each frame, the oldest of a frame first.

    Coordinates are metres with y up (``tracks.columns``). ``Cd`` is linear light and may exceed 1,
    ``pscale`` is the width. With a texture, ``cell`` is the index of the cell it shows. Lifetimes
    are cut off at the end of the animation. If the first frame has no flake, it gets a point
    without size and light.
    """
    assert_finite(tracks)
    textured = tracks.texture is not None
    attributes = {**_ATTRIBUTES, **(_CELL if textured else {})}
    decimals = [*_DECIMALS, *([DECIMALS[CELL]] if textured else [])]
    frames = [*_points(tracks), np.zeros((0, len(decimals)))]
    if not len(frames[0]):
        frames[0] = _invisible_point(frames, tracks.fps)
    header = {
        "version": "1.0",
        "num_samples": sum(map(len, frames)),
        "num_frames": len(frames),
        "num_points": len(np.unique(np.concatenate([rows[:, _ID] for rows in frames]))),
        "num_attrib": len(attributes),
        "attrib_name": list(attributes),
        "attrib_size": list(attributes.values()),
        "attrib_data_type": ["l", *"f" * (len(decimals) - 1)],  # int32, float32
        "data_type": "linear",
    }
    body = b",\n".join(
        _frame(rows, i, frame_time(tracks, i), decimals) for i, rows in enumerate(frames)
    )
    head = json.dumps(header).encode()
    data = b'{"header": %s,\n"cache_data": {"frames": [\n%s\n]}}\n' % (head, body)
    return OutputFile(flakes_file(name, "hjson"), "tracks", data)


def _frame(rows: _Rows, frame: int, time: float, decimals: list[int]) -> bytes:
    text = table_text(rows, decimals, "[", ",", "],\n").removesuffix(b",\n")
    head = b'{"number": %d, "time": %a, "num_points": %d, "frame_data": [\n%s]}'
    return head % (frame + 1, time, len(rows), text)


def _points(tracks: Tracks) -> list[_Rows]:
    """Return the points of each frame; lifetimes end before the empty frame that is added."""
    counts = [len(table) for table in tracks.frames]
    frame = tracks.frame_numbers
    row = by_column(np.concatenate(tracks.frames))
    position, velocity, width = in_world(tracks, row)
    born = frame / tracks.fps - row["age"]
    end = (len(counts) - 0.5) / tracks.fps
    points = np.column_stack([
        tracks.unlooped_ids(),
        position,
        velocity,
        row["r"], row["g"], row["b"], row["a"],
        width,
        row["age"],
        np.minimum(row["life"], end - born),
        *([] if tracks.texture is None else [np.concatenate(tracks.texture.cells)]),
    ])  # fmt: skip
    order = np.lexsort((points[:, _ID], -points[:, _AGE], frame))
    return np.split(points[order], np.cumsum(counts)[:-1])


def _invisible_point(frames: Sequence[_Rows], fps: float) -> _Rows:
    """Return a point without size and light that lives for one frame, with an unused id."""
    point = np.zeros((1, frames[0].shape[1]))
    point[0, _ID] = 1 + max(rows[:, _ID].max(initial=-1) for rows in frames)
    point[0, _LIFE] = 0.5 / fps
    return point
