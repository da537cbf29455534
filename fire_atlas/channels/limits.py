"""Check which maps a recipe's pages can have. Kept free of heavy imports for `fire-atlas check`."""

from collections.abc import Iterator

from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas, Maps
from fire_atlas.recipe.problem import Problem
from fire_atlas.recipe.source import FramesSource, ProfileSource, Source


def heat_limits(recipe: Recipe) -> Iterator[Problem]:
    """Yield a problem for each map, and for a texture of flakes, that pages of heat cannot have."""
    pixels, maps = recipe.atlas.pixels, recipe.maps
    if pixels == "heat4" and maps != Maps():
        yield Problem(
            ("maps",),
            "four frames lie in one cell, where a map has room for one; set atlas.pixels to heat",
        )
    if pixels == "heat" and maps.smoke:
        yield Problem(
            ("maps", "smoke"),
            "its colours are apart from the fire's, while clients of heat look up all colours of a "
            "page; leave it out, or set atlas.pixels to color",
        )
    if pixels != "color" and recipe.flakes != "none" and recipe.flakes.own_texture is not None:
        yield Problem(
            ("flakes", "texture"),
            "its cells have colours of their own, which pages of heat do not store; leave it out, "
            "or set atlas.pixels to color",
        )


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
    for key, has_vectors in (("motion", maps.motion != "none"), ("haze", maps.haze)):
        if has_vectors and atlas.rotate:
            yield Problem(
                ("maps", key),
                "vectors cannot be read from frames that lie rotated; leave out atlas.rotate",
            )
    for kind in maps.form if atlas.rotate else ():
        yield Problem(
            ("maps", kind),
            "frames that lie rotated would face other ways; leave out atlas.rotate",
        )
    if not has_flakes:
        for layer in set(maps.layers) - {"smoke"}:
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


def form_limits(maps: Maps, source: Source | None) -> Iterator[Problem]:
    """Yield a problem for each map that a source has nothing for."""
    if isinstance(source, FramesSource):
        for kind in maps.form:
            yield Problem(
                ("maps", kind),
                "frames are flat pictures, whose form is not known; make fire with form by "
                "source.kind: silk or source.kind: profile, or leave this map out",
            )
    if isinstance(source, ProfileSource) and maps.smoke:
        yield Problem(
            ("maps", "smoke"),
            "a profile is learnt from flame alone and has no smoke; leave this map out, or use "
            "the clip itself (source.kind: frames)",
        )
