"""The sprites of a sheet in Unity's terms: names, ids, rectangles and pivots.

Unity measures pages, rectangles and pivots from the bottom left, y up.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from fire_atlas.atlas.polygon import rectangle
from fire_atlas.atlas.sheet import AtlasSheet, Region
from fire_atlas.engines.unity.names import local_file_id, sprite_guid, sprite_names

_MIN_MAX_SIZE = 2048
"""Smallest Max Size that is set, px: Unity's default."""


class SpriteRect(NamedTuple):
    """A sprite on its page, px: bottom-left corner, y up, and size."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class PageSprite:
    """A frame as a sprite of its page.

    Attributes:
        name: Its name in Unity.
        id, guid: Identify it in references, and in the Sprite Editor.
        page: GUID of its page.
        rect: Its place on the page, px, y up.
        pivot: In 0..1 of the rect, y up.
        outline: Vertices of what of it is drawn, clockwise, px from the middle of the rect, y
            up; none on a sheet without meshes.
        border: Widths of what is not stretched, px: left, bottom, right, top.
    """

    name: str
    id: int
    guid: str
    page: str
    rect: SpriteRect
    pivot: tuple[float, float]
    outline: tuple[tuple[float, float], ...]
    border: tuple[int, int, int, int]


def sprites_of(sheet: AtlasSheet, guid: Callable[[str], str]) -> dict[str, PageSprite]:
    """Return the sprite of every frame, by its name, in playing order, then single sprites and
    cells of textures.

    Args:
        sheet: The pages.
        guid: Gives the GUID of a file.
    """
    names = sprite_names(region.name for region in sheet.placed)
    return {
        region.name: PageSprite(
            name=names[region.name],
            id=local_file_id("sprite", names[region.name]),
            guid=sprite_guid(names[region.name]),
            page=guid(sheet.pages[region.page].file),
            rect=rect_of(region, sheet.pages[region.page].height),
            pivot=pivot_of(region),
            outline=outline_of(region) if sheet.has_meshes else (),
            border=border_of(region),
        )
        for region in sheet.placed
    }


def rect_of(region: Region, page_height: int) -> SpriteRect:
    """Return the rectangle of a frame on a page of that height, px."""
    bottom = page_height - region.y - region.height
    return SpriteRect(region.x, bottom, region.width, region.height)


def pivot_of(region: Region) -> tuple[float, float]:
    """Return the pivot (x, y) in 0..1 of the trimmed frame, y up; it may lie outside."""
    x, y = pivot_px(region)
    bottom = region.trim_y + region.height
    return (x - region.trim_x) / region.width, (bottom - y) / region.height


def outline_of(region: Region) -> tuple[tuple[float, float], ...]:
    """Return the outline of what is drawn of a frame; that of its rectangle if it has no mesh.

    Unity would find an outline of its own for a sprite without one.
    """
    width, height = region.width, region.height
    vertices = region.mesh.vertices if region.mesh else rectangle(0, 0, width, height)
    return tuple((x - width / 2, height / 2 - y) for x, y in vertices)


def border_of(region: Region) -> tuple[int, int, int, int]:
    """Return the border of a frame in Unity's order: left, bottom, right, top."""
    if region.border is None:
        return 0, 0, 0, 0
    left, top, right, bottom = region.border
    return left, bottom, right, top


def pivot_px(region: Region) -> tuple[float, float]:
    """Return the pivot (x, y) in px of the untrimmed frame, y down."""
    return region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height


def max_texture_size(width: int, height: int) -> int:
    """Return the import setting Max Size with which Unity does not shrink a page of that size."""
    return max(_MIN_MAX_SIZE, 1 << (max(width, height) - 1).bit_length())
