"""Flakes as Houdini's point cache in JSON, as the plugin HoudiniNiagara reads it for Unreal.

Niagara emits a point when its id first appears and keeps it for its life, so that every id is one
unbroken flight: a flake that flies on from a loop's last frame into its first has a second id
there. One empty frame at the end, when the loop starts over, lies behind every life: a point that
lives on in the last frame would never die.
"""

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from fire_atlas.formats.decimals import table_text
from fire_atlas.formats.tracks.columns import DECIMALS, assert_finite, frame_time
from fire_atlas.formats.tracks.names import flakes_file
from fire_atlas.formats.tracks.world import METRES, SPEED, place, velocity

_ATTRIBUTES = {"id": 1, "P": 3, "v": 3, "Cd": 3, "alpha": 1, "pscale": 1, "age": 1, "life": 1}
"""Attributes of a point, each with its number of components."""

_DECIMALS = [
    0, *[METRES] * 3, *[SPEED] * 3, *(DECIMALS[channel] for channel in "rgba"), METRES,
    DECIMALS["age"], DECIMALS["life"],
]  # fmt: skip
_ID, _AGE, _LIFE = 0, 12, 13

_Rows = NDArray[np.float64]
"""(points, 14), columns as ``_ATTRIBUTES``."""


def write_tracks_hjson(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.hjson``: every flake in every frame, the oldest of a frame first.

    Metres with y up, as Houdini has them (``tracks.world``); ``Cd`` is linear light that may
    exceed 1, ``pscale`` the width. Lives of flakes that are cut off by the end are shortened to it.
    The first frame always has a point: where it has no flake, one without size and light.
    """
    assert_finite(tracks)
    frames = [*_points(tracks), np.zeros((0, len(_DECIMALS)))]
    if not len(frames[0]):
        frames[0] = _unseen(frames, tracks.fps)
    header = {
        "version": "1.0",
        "num_samples": sum(map(len, frames)),
        "num_frames": len(frames),
        "num_points": len(np.unique(np.concatenate([rows[:, _ID] for rows in frames]))),
        "num_attrib": len(_ATTRIBUTES),
        "attrib_name": list(_ATTRIBUTES),
        "attrib_size": list(_ATTRIBUTES.values()),
        "attrib_data_type": ["l", *"f" * (len(_DECIMALS) - 1)],  # int32, float32
        "data_type": "linear",
    }
    body = b",\n".join(_frame(rows, i, frame_time(tracks, i)) for i, rows in enumerate(frames))
    head = json.dumps(header).encode()
    data = b'{"header": %s,\n"cache_data": {"frames": [\n%s\n]}}\n' % (head, body)
    return OutputFile(flakes_file(name, "hjson"), "tracks", data)


def _frame(rows: _Rows, frame: int, time: float) -> bytes:
    text = table_text(rows, _DECIMALS, "[", ",", "],\n").removesuffix(b",\n")
    head = b'{"number": %d, "time": %a, "num_points": %d, "frame_data": [\n%s]}'
    return head % (frame + 1, time, len(rows), text)


def _points(tracks: Tracks) -> list[_Rows]:
    """Return the points of each frame; none lives on into the frame behind the last."""
    counts = [len(table) for table in tracks.frames]
    frame = tracks.frame_numbers
    row = dict(zip(COLUMNS, np.concatenate(tracks.frames).T, strict=True))
    born = frame / tracks.fps - row["age"]
    end = (len(counts) - 0.5) / tracks.fps
    points = np.column_stack([
        tracks.unlooped_ids(),
        place(tracks, row["x"], row["y"]),
        velocity(tracks, row["vx"], row["vy"]),
        row["r"], row["g"], row["b"], row["a"],
        row["size"] / tracks.height,
        row["age"],
        np.minimum(row["life"], end - born),
    ])  # fmt: skip
    order = np.lexsort((points[:, _ID], -points[:, _AGE], frame))
    return np.split(points[order], np.cumsum(counts)[:-1])


def _unseen(frames: Sequence[_Rows], fps: float) -> _Rows:
    """Return a point that nobody sees and that ends with its frame, of an id that none has."""
    point = np.zeros((1, len(_DECIMALS)))
    point[0, _ID] = 1 + max(rows[:, _ID].max(initial=-1) for rows in frames)
    point[0, _LIFE] = 0.5 / fps
    return point
