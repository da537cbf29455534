"""What TexturePacker's JSON says of frames and pages, in every arrangement of it.

What is written is read by the function next to its writer. Readers raise KeyError, TypeError or
ValueError where an entry is not what its writer makes.
"""

import json
from collections.abc import Sequence
from typing import Any

from fire_atlas import __version__
from fire_atlas.atlas.sheet import AtlasSheet, CellGrid, Page, Region
from fire_atlas.core.output_file import plain_name
from fire_atlas.formats.atlas.maps import map_entries
from fire_atlas.formats.checks import MOST_MILLISECONDS, number, text, whole
from fire_atlas.formats.decimals import plain

_FARTHEST = 1000.0
"""How far from its frame a pivot may lie, in sizes of the frame."""


def compact(value: Any) -> str:
    """Return strict JSON without needless space."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def frame_entry(region: Region) -> dict[str, Any]:
    """Return where a frame is; ``frame`` has its upright size even where it lies rotated."""
    size = {"w": region.width, "h": region.height}
    return {
        "frame": {"x": region.x, "y": region.y, **size},
        "rotated": region.rotated,
        "trimmed": region.trimmed,
        "spriteSourceSize": {"x": region.trim_x, "y": region.trim_y, **size},
        "sourceSize": {"w": region.frame_width, "h": region.frame_height},
        "duration": plain(region.duration, 3),
        "anchor": {"x": plain(region.anchor[0], 6), "y": plain(region.anchor[1], 6)},
    }


def region_of(name: str, page: int, entry: dict[str, Any]) -> Region:
    """Return the frame ``name`` on the page of that number, as ``frame_entry`` wrote it."""
    place, trim, full = entry["frame"], entry["spriteSourceSize"], entry["sourceSize"]
    anchor = entry.get("anchor", {"x": 0.5, "y": 0.5})
    return Region(
        name=text(name),
        page=page,
        x=whole(place["x"]),
        y=whole(place["y"]),
        width=whole(place["w"]),
        height=whole(place["h"]),
        rotated=bool(entry.get("rotated")),
        trim_x=whole(trim["x"]),
        trim_y=whole(trim["y"]),
        frame_width=whole(full["w"], 1),
        frame_height=whole(full["h"], 1),
        anchor=(_anchor(anchor["x"]), _anchor(anchor["y"])),
        duration=number(entry["duration"], 0, MOST_MILLISECONDS),
    )


def _anchor(value: Any) -> float:
    return number(value, -_FARTHEST, _FARTHEST)


def page_entry(sheet: AtlasSheet, page: int) -> dict[str, Any]:
    """Return what says which image a page is."""
    return {
        "image": sheet.pages[page].file,
        "format": "RGBA8888",
        "size": {"w": sheet.pages[page].width, "h": sheet.pages[page].height},
        "scale": f"{sheet.scale:g}",
    }


def meta_entry(sheet: AtlasSheet, page: int, regions: Sequence[Region]) -> dict[str, Any]:
    """Return what holds for a whole page with these frames."""
    return {
        "app": "fire-atlas",
        "version": __version__,
        **page_entry(sheet, page),
        "frameTags": frame_tags(sheet, regions),
        **({"maps": map_entries(sheet, page)} if sheet.maps else {}),
        "fireAtlas": about_entry(sheet, page),
    }


def page_of(meta: dict[str, Any]) -> Page:
    """Return a page, as ``meta_entry`` wrote it."""
    size, safe_mip = meta["size"], meta.get("fireAtlas", {}).get("safeMipLevel")
    return Page(
        file=plain_name(meta["image"]),
        width=whole(size["w"], 1),
        height=whole(size["h"], 1),
        safe_mip=None if safe_mip is None else whole(safe_mip, 0, 32),
    )


def about_entry(sheet: AtlasSheet, page: int) -> dict[str, Any]:
    """Return what only this tool writes: how to draw the page, and how far to filter it."""
    return {
        "alpha": sheet.alpha,
        "blendSpace": sheet.blend_space,
        "fps": plain(sheet.fps, 6),
        "loops": {animation.name: animation.loop for animation in sheet.animations},
        "safeMipLevel": sheet.pages[page].safe_mip,
        **({"grid": _grid_entry(sheet.grid)} if sheet.grid else {}),
    }


def _grid_entry(grid: CellGrid) -> dict[str, Any]:
    return {
        "columns": grid.columns,
        "rows": grid.rows,
        "cellWidth": grid.cell_width,
        "cellHeight": grid.cell_height,
    }


def grid_of(about: dict[str, Any]) -> CellGrid | None:
    """Return how the page divides into cells, as ``about_entry`` wrote it; None if it does not."""
    entry = about.get("grid")
    if entry is None:
        return None
    return CellGrid(
        columns=whole(entry["columns"], 1),
        rows=whole(entry["rows"], 1),
        cell_width=whole(entry["cellWidth"], 1),
        cell_height=whole(entry["cellHeight"], 1),
    )


def animations_on(sheet: AtlasSheet, regions: Sequence[Region]) -> dict[str, list[str]]:
    """Return the animations as far as they play with these frames.

    PixiJS looks frames up on their own page only, and breaks on a name it cannot find there. An
    animation that needed several pages is joined by the client; names sort in playing order:
    ``[sheet, ...sheet.linkedSheets].flatMap((page) => page.animations.campfire ?? [])`` and
    ``.sort((a, b) => (a.label < b.label ? -1 : 1))``.
    """
    here = {region.name for region in regions}
    parts = {
        animation.name: [frame for frame in animation.frames if frame in here]
        for animation in sheet.animations
    }
    return {animation: frames for animation, frames in parts.items() if frames}


def frame_tags(sheet: AtlasSheet, regions: Sequence[Region]) -> list[dict[str, Any]]:
    """Return Aseprite's tags: which of these frames an animation plays, from the first to the last.

    A part of one whose frames do not follow one another here has no tag.
    """
    number = {region.name: i for i, region in enumerate(regions)}
    tags = []
    for animation in sheet.animations:
        played = [number[name] for name in animation.frames if name in number]
        if played and played == list(range(played[0], played[-1] + 1)):
            tag = {"name": animation.name, "from": played[0], "to": played[-1]}
            once = {} if animation.loop else {"repeat": "1"}
            tags.append({**tag, "direction": "forward", **once})
    return tags
