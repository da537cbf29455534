"""What pages of heat cannot have. Kept free of heavy imports, for ``fire-atlas check``."""

from collections.abc import Iterator

from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Maps
from fire_atlas.recipe.problem import Problem
from fire_atlas.recipe.ramps import FLAME_RAMP


def heat_problems(recipe: Recipe) -> Iterator[Problem]:
    """Yield a problem for each map, and for colours, that pages of heat cannot have."""
    pixels, maps = recipe.atlas.pixels, recipe.maps
    yield from flame_ramp_problems(recipe)
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


def flame_ramp_problems(recipe: Recipe) -> Iterator[Problem]:
    """Yield a problem if the flame is to be in a ramp's colours, but pages store heat."""
    if recipe.atlas.pixels != "color" and recipe.composite.ramp != "none":
        yield Problem(
            FLAME_RAMP,
            "colours the pixels of pages, but with atlas.pixels: "
            f"{recipe.atlas.pixels} a page takes its colours from atlas.ramp; name the ramp there",
        )
