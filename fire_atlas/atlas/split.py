"""Animations that no page can hold, and how large a page would have to be."""

from collections.abc import Collection

from fire_atlas.atlas.grid import sufficient_grid_side
from fire_atlas.atlas.pack import sufficient_side
from fire_atlas.atlas.page_rules import PackingUnits, Size
from fire_atlas.atlas.sheet import Animation, AtlasSheet, Region
from fire_atlas.recipe.output import MAX_PAGE_SIDE, Atlas


def split_animations(sheet: AtlasSheet) -> list[Animation]:
    """Return the animations whose frames lie on several pages."""
    page = {region.name: region.page for region in sheet.regions}
    return [each for each in sheet.animations if len({page[frame] for frame in each.frames}) > 1]


def max_size_for(
    animations: Collection[Animation], sheet: AtlasSheet, settings: Atlas
) -> int | None:
    """Return an ``atlas.max_size``, px, with which each animation of a sheet has one page.

    It is not always the least. None if the largest that a recipe may state is not enough.
    """
    units = PackingUnits.of(settings)
    most = MAX_PAGE_SIDE // units.px
    sides = [
        sufficient_grid_side(
            _sizes((*sheet.regions, *sheet.singles), units), len(each.frames), units.rules, most
        )
        if sheet.grid
        else sufficient_side(_sizes(_regions(each, sheet), units), units.rules, most)
        for each in animations
    ]
    known = [side * units.px for side in sides if side is not None]
    return max(known) if len(known) == len(sides) else None


def _regions(animation: Animation, sheet: AtlasSheet) -> list[Region]:
    """Return the frames of an animation, each of those that share a place once."""
    frames = set(animation.frames)
    places = {(r.page, r.x, r.y): r for r in sheet.regions if r.name in frames}
    return list(places.values())


def _sizes(regions: Collection[Region], units: PackingUnits) -> list[Size]:
    return [units.size(region.width, region.height) for region in regions]
