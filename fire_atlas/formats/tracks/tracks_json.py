"""Flake tracks as JSON: spawns to emit the flakes again, and every flake in every frame."""

import json
from collections.abc import Iterator
from typing import Any

from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from fire_atlas.formats.decimals import plain, table_text
from fire_atlas.formats.tracks.columns import DECIMALS, assert_finite, frame_time


def write_tracks_json(name: str, tracks: Tracks) -> OutputFile:
    """Return ``name.flakes.json``: one spawn and one flake of a frame a line."""
    assert_finite(tracks)
    head = json.dumps(_head(name, tracks), ensure_ascii=False)[:-1].encode()
    spawns = ",\n".join(_spawns(tracks)).encode()
    columns = json.dumps(COLUMNS).encode()
    frames = b",\n".join(_frame(tracks, i) for i in range(len(tracks.frames)))
    data = b'%s,\n"spawns": [\n%s\n],\n"columns": %s,\n"frames": [\n%s\n]}\n'
    return OutputFile(f"{name}.flakes.json", "tracks", data % (head, spawns, columns, frames))


def _head(name: str, tracks: Tracks) -> dict[str, Any]:
    return {
        "format": "fire-atlas/tracks",
        "version": 1,
        "name": name,
        "fps": plain(tracks.fps, 6),
        "frame_count": len(tracks.frames),
        "loop": tracks.loop,
        "seed": tracks.seed,
        "size": [tracks.width, tracks.height],
        "space": "source pixels, x right, y down, (0,0) top-left corner",
        "units": "px, px/s, s, rad",
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
