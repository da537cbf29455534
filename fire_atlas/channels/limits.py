"""Check which maps a recipe's pages can have. Kept free of heavy imports for `fire-atlas check`."""

from collections.abc import Iterator

from fire_atlas.recipe.output import Atlas, Maps
from fire_atlas.recipe.problem import Problem


def map_limits(maps: Maps, atlas: Atlas, has_flakes: bool) -> Iterator[Problem]:
    """Yield a problem for each map that pages with these settings cannot have.

    ``has_flakes``: whether any effect on the pages may have flakes.
    """
    if maps.motion in ("unity", "unreal") and atlas.layout != "grid":
        yield Problem(
            ("maps", "motion"),
            f"{maps.motion} motion vectors need a flipbook with cells of equal size; "
            f"set atlas.layout to grid",
        )
    if maps.motion != "none" and atlas.rotate:
        yield Problem(
            ("maps", "motion"),
            "vectors cannot be read from frames that lie rotated; leave out atlas.rotate",
        )
    if not has_flakes:
        for layer in maps.layers:
            content = "a copy of the page" if layer == "flame" else "empty"
            yield Problem(
                ("maps", layer),
                f"this effect has no flakes, so this map would be {content}; leave it out",
            )
    if maps != Maps() and atlas.dedupe and "dedupe" in atlas.model_fields_set:
        yield Problem(
            ("maps",),
            "frames that look alike may differ in their maps, so each has a place of its own; "
            "leave out atlas.dedupe, or set it to false",
        )
