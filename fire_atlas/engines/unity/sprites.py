"""The sprites of a sheet, as Unity refers to them."""

from collections.abc import Callable
from dataclasses import dataclass

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.engines.unity.geometry import Rect, pivot_of, rect_of
from fire_atlas.engines.unity.identity import part_id, sprite_guid
from fire_atlas.engines.unity.names import sprite_names


@dataclass(frozen=True, slots=True)
class SpriteOfPage:
    """A frame as a sprite of its page.

    Attributes:
        name: In Unity.
        id, guid: What refers to it, inside its page's assets and in the Sprite Editor.
        page: GUID of its page.
        rect: Where it is on the page, px, y up.
        pivot: In 0..1 of the rect, y up.
    """

    name: str
    id: int
    guid: str
    page: str
    rect: Rect
    pivot: tuple[float, float]


def sprites_of(sheet: AtlasSheet, guid: Callable[[str], str]) -> dict[str, SpriteOfPage]:
    """Return the sprite of every frame, by the frame's name, in playing order.

    Args:
        sheet: The pages.
        guid: Gives the GUID of a file.
    """
    names = sprite_names(region.name for region in sheet.regions)
    return {
        region.name: SpriteOfPage(
            name=names[region.name],
            id=part_id("sprite", names[region.name]),
            guid=sprite_guid(names[region.name]),
            page=guid(sheet.pages[region.page].file),
            rect=rect_of(region, sheet.pages[region.page].height),
            pivot=pivot_of(region),
        )
        for region in sheet.regions
    }
