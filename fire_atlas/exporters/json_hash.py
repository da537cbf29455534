"""TexturePacker's JSON hash, as PixiJS, Phaser and most engines read it: one file a page."""

import json
from collections.abc import Iterator
from typing import Any

from fire_atlas import __version__
from fire_atlas.atlas.layout import AtlasSheet, Region
from fire_atlas.atlas.pages import page_file
from fire_atlas.exporters.decimals import plain
from fire_atlas.exporters.output_file import OutputFile


def export_json_hash(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.json``, ``name-1.json``, ...: each describes one page."""
    for page in range(len(sheet.pages)):
        text = _page_text(sheet, page)
        yield OutputFile(page_file(sheet.name, page, ".json"), "atlas", text.encode())


def _page_text(sheet: AtlasSheet, page: int) -> str:
    """Return the page's JSON with one frame a line: small, and good to look at in a diff."""
    regions = [region for region in sheet.regions if region.page == page]
    frames = ",\n".join(
        f"{_compact(region.name)}:{_compact(_frame(sheet, region))}" for region in regions
    )
    return (
        f'{{"frames":{{\n{frames}\n}},\n'
        f'"animations":{_compact(_animations(sheet, regions))},\n'
        f'"meta":{_compact(_meta(sheet, page))}}}\n'
    )


def _frame(sheet: AtlasSheet, region: Region) -> dict[str, Any]:
    size = {"w": region.width, "h": region.height}
    source_size = {"w": sheet.frame_width, "h": sheet.frame_height}
    return {
        "frame": {"x": region.x, "y": region.y, **size},
        "rotated": False,
        "trimmed": size != source_size,
        "spriteSourceSize": {"x": region.trim_x, "y": region.trim_y, **size},
        "sourceSize": source_size,
        "duration": plain(region.duration, 3),
        "anchor": {"x": plain(sheet.anchor[0], 4), "y": plain(sheet.anchor[1], 4)},
    }


def _animations(sheet: AtlasSheet, regions: list[Region]) -> dict[str, list[str]]:
    """Return the animations as far as they play on this page.

    PixiJS looks frames up on their own page only, and breaks on a name it cannot find there. An
    animation that needed several pages is joined by the client, page after page:
    ``[sheet, ...sheet.linkedSheets].flatMap((page) => page.animations.campfire)``.
    """
    here = {region.name for region in regions}
    parts = {
        animation: [frame for frame in frames if frame in here]
        for animation, frames in sheet.animations.items()
    }
    return {animation: frames for animation, frames in parts.items() if frames}


def _meta(sheet: AtlasSheet, page: int) -> dict[str, Any]:
    """Return what holds for the whole page. Only the first page links to the others."""
    siblings = [page_file(sheet.name, i, ".json") for i in range(1, len(sheet.pages))]
    return {
        "app": "fire-atlas",
        "version": __version__,
        "image": sheet.pages[page].file,
        "format": "RGBA8888",
        "size": {"w": sheet.pages[page].width, "h": sheet.pages[page].height},
        "scale": "1",
        **({"related_multi_packs": siblings} if siblings and page == 0 else {}),
        "fireAtlas": {
            "alpha": sheet.alpha,
            "blendSpace": sheet.blend_space,
            "fps": plain(sheet.fps, 6),
        },
    }


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
