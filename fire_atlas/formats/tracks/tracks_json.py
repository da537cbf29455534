"""Write flake tracks as JSON: the spawns of all flakes, and each flake in each frame.

``preview`` and ``inspect`` read the files back.
"""

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.checks import number, one_of, text, whole
from fire_atlas.core.decimals import plain, table_text
from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MIB, read_file
from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH
from fire_atlas.effect.flakes.tracks import (
    COLUMNS,
    DEPTH_COLUMNS,
    SPAWN_COLUMNS,
    Table,
    Tracks,
    TrackTexture,
)
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.output_names import animation_stem, flakes_file
from fire_atlas.formats.tracks.columns import (
    CELL,
    DECIMALS,
    assert_finite,
    columns_with_cells,
    frame_time,
    rows_with_cells,
)

_SIZE = COLUMNS.index("size")

_MAX_BYTES = 256 * MIB
"""Limit on the size of tracks that are read."""

_MAX_NUMBER = 2.0**53
"""Limit on numbers accepted when reading: float64 is exact for all integers below it."""


def write_tracks_json(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.json``, with a line per spawn, and one per flake and frame."""
    assert_finite(tracks)
    head = json.dumps(_head(name, tracks), ensure_ascii=False)[:-1].encode()
    spawns = ",\n".join(_spawns(tracks)).encode()
    columns = json.dumps(columns_with_cells(tracks)).encode()
    frames = b",\n".join(_frame(tracks, i) for i in range(len(tracks.frames)))
    data = b'%s,\n"spawns": [\n%s\n],\n"columns": %s,\n"frames": [\n%s\n]}\n'
    return OutputFile(flakes_file(name, "json"), "tracks", data % (head, spawns, columns, frames))


def _head(name: str, tracks: Tracks) -> dict[str, Any]:
    camera = tracks.camera
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
        **({"texture": _texture_entry(tracks.texture)} if tracks.texture else {}),
        **({} if camera is None else {"camera": _camera(camera)}),
    }


def _texture_entry(texture: TrackTexture) -> dict[str, Any]:
    return {"frames": texture.frames, "tint": "heat" if texture.tinted else "none"}


def _camera(camera: Camera) -> dict[str, Any]:
    """Return a camera as the file has it: angles in degrees, lengths in px of the frame."""
    away = camera.distance * camera.scale
    return {
        "azimuth": plain(math.degrees(camera.azimuth), 6),
        "elevation": plain(math.degrees(camera.elevation), 6),
        "origin": [plain(place, 3) for place in camera.origin],
        "distance": None if math.isinf(away) else plain(away, 3),
        "tiles": camera.tiles,
    }


def _camera_of(document: dict[str, Any], width: int, height: int) -> Camera | None:
    """Return the camera that a file states, if any; its unit of length is a px of the frame."""
    if "camera" not in document:
        return None
    stated = document["camera"]
    away = stated["distance"]
    x, y = (number(place, -_MAX_NUMBER, _MAX_NUMBER) for place in stated["origin"])
    return Camera(
        math.radians(number(stated["azimuth"], -360, 360)),
        math.radians(number(stated["elevation"], -90, 90)),
        width,
        height,
        (x, y),
        1.0,
        math.inf if away is None else number(away, 1, _MAX_NUMBER),
        bool(stated["tiles"]),
    )


def _spawns(tracks: Tracks) -> Iterator[str]:
    decimals = [DECIMALS[column] for column in tracks.spawn_columns]
    for row in tracks.spawns.tolist():
        rounded = map(round, row, decimals)
        spawn: dict[str, Any] = dict(zip(tracks.spawn_columns, rounded, strict=True))
        spawn |= {"id": int(spawn["id"]), "wraps": bool(spawn["wraps"])}
        yield json.dumps(spawn)


def _frame(tracks: Tracks, frame: int) -> bytes:
    decimals = [DECIMALS[column] for column in columns_with_cells(tracks)]
    rows = table_text(rows_with_cells(tracks, frame), decimals, "[", ",", "],\n").removesuffix(
        b",\n"
    )
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
        return _tracks(json.loads(read_file(path, _MAX_BYTES)))
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
    stated, camera = document["columns"], _camera_of(document, width, height)
    depth = DEPTH_COLUMNS * (camera is not None)
    order = [stated.index(column) for column in COLUMNS + depth]
    columns, born = SPAWN_COLUMNS + depth, document["spawns"]
    spawns = _table([[spawn[column] for column in columns] for spawn in born], len(columns))
    tables = [_table(frame["rows"], len(stated)) for frame in document["frames"]]
    frames = [table[:, order] for table in tables]
    if any((rows[:, _SIZE] < 0).any() for rows in frames):
        raise ValueError("a flake has a negative size")
    seed, loop = whole(document["seed"], 0, 2**64), bool(document["loop"])
    rounds = whole(document["rounds"], 1, len(frames))
    if len(frames) % rounds:
        raise ValueError(f"{len(frames)} frames are not {rounds} rounds")
    texture = _texture_of(document, tables)
    return Tracks.of_tables(
        fps, (width, height), loop, seed, spawns, frames, rounds, texture, camera
    )


def _texture_of(document: dict[str, Any], tables: Sequence[Table]) -> TrackTexture | None:
    if "texture" not in document:
        return None
    names = tuple(text(name) for name in document["texture"]["frames"])
    tint = one_of(document["texture"]["tint"], ("heat", "none"))
    column = document["columns"].index(CELL)
    cells = tuple(table[:, column].astype(np.int64) for table in tables)
    if any(((numbers < 0) | (numbers >= len(names))).any() for numbers in cells):
        raise ValueError(f"a flake shows a cell that is none of {len(names)}")
    return TrackTexture(names, tint == "heat", cells)


def _table(rows: Sequence[Any], columns: int) -> NDArray[np.float64]:
    table = np.array(rows, np.float64).reshape(-1, columns)
    if not (np.abs(table) < _MAX_NUMBER).all():
        raise ValueError("a value is not a number, or is too large")
    return table
