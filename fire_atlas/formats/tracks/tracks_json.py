"""Write flake tracks as JSON: the spawns of all flakes, and each flake in each frame.

``preview`` and ``inspect`` read the files back.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MAX_JSON_BYTES, read_file
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.checks import number, whole
from fire_atlas.formats.decimals import plain, table_text
from fire_atlas.formats.names import animation_stem, flakes_file
from fire_atlas.formats.tracks.columns import DECIMALS, assert_finite, frame_time

_SIZE = COLUMNS.index("size")

_MAX_NUMBER = 2.0**53
"""Limit on numbers accepted when reading: float64 is exact for all integers below it."""


def write_tracks_json(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.json``, with a line per spawn, and one per flake and frame."""
    assert_finite(tracks)
    head = json.dumps(_head(name, tracks), ensure_ascii=False)[:-1].encode()
    spawns = ",\n".join(_spawns(tracks)).encode()
    columns = json.dumps(COLUMNS).encode()
    frames = b",\n".join(_frame(tracks, i) for i in range(len(tracks.frames)))
    data = b'%s,\n"spawns": [\n%s\n],\n"columns": %s,\n"frames": [\n%s\n]}\n'
    return OutputFile(flakes_file(name, "json"), "tracks", data % (head, spawns, columns, frames))


def _head(name: str, tracks: Tracks) -> dict[str, Any]:
    return {
        "format": "fire-atlas/tracks",
        "version": 2,
        "name": name,
        "fps": plain(tracks.fps, 6),
        "frame_count": len(tracks.frames),
        "loop": tracks.loop,
        "rounds": tracks.rounds,
        "seed": tracks.seed,
        "size": [tracks.width, tracks.height],
        "space": "source pixels, x right, y down, (0,0) top-left corner",
        "units": "px, px/s, s, rad",
        "light": {"sum": "linear", "curve": "x/(1+x)", "halo": [HALO_LIGHT, HALO_WIDTH]},
    }


def _spawns(tracks: Tracks) -> Iterator[str]:
    decimals = [DECIMALS[column] for column in SPAWN_COLUMNS]
    for row in tracks.spawns.tolist():
        rounded = map(round, row, decimals)
        spawn: dict[str, Any] = dict(zip(SPAWN_COLUMNS, rounded, strict=True))
        spawn |= {"id": int(spawn["id"]), "wraps": bool(spawn["wraps"])}
        yield json.dumps(spawn)


def _frame(tracks: Tracks, frame: int) -> bytes:
    decimals = [DECIMALS[column] for column in COLUMNS]
    rows = table_text(tracks.frames[frame], decimals, "[", ",", "],\n").removesuffix(b",\n")
    return b'{"i": %d, "t": %a, "rows": [\n%s]}' % (frame, frame_time(tracks, frame), rows)


def read_all_tracks(atlas: AtlasFile) -> dict[str, Tracks]:
    """Read the tracks beside an atlas, by the names of their animations."""
    names = [animation.name for animation in atlas.sheet.animations]
    files = {name: flakes_file(animation_stem(atlas.sheet.title, name), "json") for name in names}
    found = {name: read_tracks(atlas.path.with_name(file)) for name, file in files.items()}
    return {name: tracks for name, tracks in found.items() if tracks is not None}


def read_tracks(path: Path) -> Tracks | None:
    """Read the tracks in a file; None if there is no such file.

    The file does not say which rows are of one flight; that is recomputed from spawns and ages.

    Raises:
        SourceError: The file was not written by ``write_tracks_json``.
    """
    if not path.exists():
        return None
    try:
        return _tracks(json.loads(read_file(path, MAX_JSON_BYTES)))
    except OSError as error:
        raise SourceError(f"{path}: the tracks cannot be read ({error.strerror})") from None
    except (
        LookupError, TypeError, AttributeError, ValueError, ArithmeticError, RecursionError
    ) as error:  # fmt: skip
        raise SourceError(
            f"{path}: is not a file of flake tracks that fire-atlas wrote "
            f"({type(error).__name__}: {error}); build the recipe again"
        ) from error


def _tracks(document: dict[str, Any]) -> Tracks:
    fps = number(document["fps"], 0.001, 1e6)
    width, height = (whole(length, 1) for length in document["size"])
    order = [document["columns"].index(column) for column in COLUMNS]
    spawn_rows = [[spawn[column] for column in SPAWN_COLUMNS] for spawn in document["spawns"]]
    spawns = _table(spawn_rows, len(SPAWN_COLUMNS))
    frames = [_table(frame["rows"], len(COLUMNS))[:, order] for frame in document["frames"]]
    if any((rows[:, _SIZE] < 0).any() for rows in frames):
        raise ValueError("a flake has a negative size")
    seed, loop = whole(document["seed"], 0, 2**64), bool(document["loop"])
    rounds = whole(document["rounds"], 1, len(frames))
    if len(frames) % rounds:
        raise ValueError(f"{len(frames)} frames are not {rounds} rounds")
    return Tracks.of_tables(fps, (width, height), loop, seed, spawns, frames, rounds)


def _table(rows: Sequence[Any], columns: int) -> NDArray[np.float64]:
    table = np.array(rows, np.float64).reshape(-1, columns)
    if not (np.abs(table) < _MAX_NUMBER).all():
        raise ValueError("a value is not a number, or is too large")
    return table
