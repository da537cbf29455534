"""Phaser's multi-atlas: one JSON file with all pages and animations."""

from collections.abc import Iterator
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.decimals import plain
from fire_atlas.core.output_file import OutputFile
from fire_atlas.core.version import __version__
from fire_atlas.formats.atlas.entries import (
    APP,
    about_entry,
    compact,
    frame_entry,
    map_entries,
    page_entry,
    texture_entries,
)
from fire_atlas.formats.tables import EXPORTS


def export_phaser(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.phaser.json``, for ``load.multiatlas`` and ``load.animation``.

    Animations refer to the texture by the sheet's title, which is the same in every scale.
    """
    textures = ",\n".join(_texture(sheet, page) for page in range(len(sheet.pages)))
    maps = [entry for i in range(len(sheet.pages)) for entry in map_entries(sheet, i)]
    meta: dict[str, Any] = {
        "app": APP,
        "version": __version__,
        "fireAtlas": about_entry(sheet, 0),
    }
    meta |= {"maps": maps} if maps else {}
    compressed = [entry for i in range(len(sheet.pages)) for entry in texture_entries(sheet, i)]
    meta |= {"gpu": compressed} if compressed else {}
    text = (
        f'{{"textures":[\n{textures}\n],\n'
        f'"anims":{compact(_animations(sheet))},\n'
        f'"meta":{compact(meta)}}}\n'
    )
    yield OutputFile(sheet.file(0, EXPORTS["phaser"].ending), "atlas", text.encode())


def _texture(sheet: AtlasSheet, page: int) -> str:
    head = compact(page_entry(sheet, page))[:-1]
    frames = ",\n".join(
        compact({"filename": region.name, **frame_entry(region)})
        for region in sheet.regions_of(page)
    )
    return f'{head},"frames":[\n{frames}\n]}}'


def _animations(sheet: AtlasSheet) -> list[dict[str, Any]]:
    """Return the animations. All frames of one last equally long, so `frameRate` says it all, and
    Phaser before 3.80 would add a frame's `duration` to it."""
    durations = {region.name: region.duration for region in sheet.regions}
    return [
        {
            "key": animation.name,
            "type": "frame",
            "frames": [{"key": sheet.title, "frame": name} for name in animation.frames],
            "frameRate": plain(1000 / durations[animation.frames[0]], 6),
            "repeat": -1 if animation.loop else 0,
        }
        for animation in sheet.animations
    ]
