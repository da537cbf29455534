"""Written flake tracks, read back."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks
from fire_atlas.formats.atlas.json_hash import AtlasFile
from fire_atlas.formats.product import stem_of


def read_all_tracks(atlas: AtlasFile) -> dict[str, Tracks]:
    """Return the flakes of each animation of an atlas that lie beside it, by its name."""
    sheet = atlas.sheet
    found = {
        animation.name: _read(atlas.path.with_name(_file(stem_of(sheet.title, animation.name))))
        for animation in sheet.animations
    }
    return {name: tracks for name, tracks in found.items() if tracks is not None}


def read_tracks(atlas: Path) -> Tracks | None:
    """Return the tracks that lie beside the atlas ``NAME.json``; None if there are none."""
    return _read(atlas.with_name(_file(atlas.stem)))


def _file(stem: str) -> str:
    return f"{stem}.flakes.json"


def _read(path: Path) -> Tracks | None:
    if not path.is_file():
        return None
    try:
        return _tracks(json.loads(path.read_bytes()))
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise SourceError(
            f"{path}: are no tracks that fire-atlas wrote ({type(error).__name__}: {error});"
            " build the recipe again"
        ) from error


def _tracks(document: dict[str, Any]) -> Tracks:
    order = [document["columns"].index(column) for column in COLUMNS]
    spawns = [[spawn[column] for column in SPAWN_COLUMNS] for spawn in document["spawns"]]
    width, height = document["size"]
    return Tracks(
        fps=document["fps"],
        width=width,
        height=height,
        loop=document["loop"],
        seed=document["seed"],
        spawns=np.array(spawns, np.float64).reshape(-1, len(SPAWN_COLUMNS)),
        frames=tuple(
            np.array(frame["rows"], np.float64).reshape(-1, len(COLUMNS))[:, order]
            for frame in document["frames"]
        ),
    )
