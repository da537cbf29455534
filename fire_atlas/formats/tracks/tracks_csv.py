"""Write flake tracks as CSV, a row per flake and frame, for spreadsheets and Houdini."""

import numpy as np

from fire_atlas.core.decimals import table_text
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.output_names import flakes_file
from fire_atlas.formats.tracks.columns import (
    DECIMALS,
    assert_finite,
    columns_with_cells,
    frame_time,
    rows_with_cells,
)


def write_tracks_csv(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.csv``: frame number, time in s, then the columns of the tracks."""
    assert_finite(tracks)
    columns = columns_with_cells(tracks)
    decimals = [0, DECIMALS["t"], *(DECIMALS[column] for column in columns)]
    header = ",".join(("frame", "t", *columns)) + "\n"
    frames = (_frame(tracks, i, decimals) for i in range(len(tracks.frames)))
    return OutputFile(flakes_file(name, "csv"), "tracks", header.encode() + b"".join(frames))


def _frame(tracks: Tracks, frame: int, decimals: list[int]) -> bytes:
    rows = rows_with_cells(tracks, frame)
    times = np.broadcast_to([float(frame), frame_time(tracks, frame)], (len(rows), 2))
    return table_text(np.hstack([times, rows]), decimals, "", ",", "\n")
