"""Animate what a recipe's source gives: views of a fire, a fire in several winds, or sprites."""

from collections.abc import Iterator, Mapping, Sequence

from fire_atlas.atlas.sheet import variant_title
from fire_atlas.core.context import BuildContext
from fire_atlas.core.fire_in_wind import FireInWind
from fire_atlas.core.pixels import Pixels
from fire_atlas.heat.ready import RampLight
from fire_atlas.pipeline.animation.animate import PreparedView, animate_views, prepared_views
from fire_atlas.pipeline.animation.contribution import Contribution, animation_title
from fire_atlas.pipeline.animation.vary import as_first, joined, require_loops, variants_of
from fire_atlas.pipeline.input.open import Opened
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe


def contribute(
    loaded: LoadedRecipe,
    opened: Opened,
    cells: Sequence[Pixels],
    ramps: Mapping[str, RampLight],
    context: BuildContext,
) -> Contribution:
    """Return the finished animations of a recipe, of all of its variants.

    Args:
        loaded: The recipe.
        opened: Its source.
        cells: Those of its flakes' texture.
        ramps: The colours of its fire, as from ``open_ramps``.
        context: Of the build.
    """
    if loaded.recipe.variants == 1:
        return _contribute(loaded.recipe, opened, cells, ramps, context)
    found = list[Contribution]()
    for variant in variants_of(loaded, opened, context):
        recipe = as_first(variant.recipe, found[0].decided) if found else variant.recipe
        found.append(_contribute(recipe, variant.opened, cells, ramps, variant.context))
    require_loops(found, loaded.recipe)
    return joined(found, loaded.recipe)


def _contribute(
    recipe: Recipe,
    opened: Opened,
    cells: Sequence[Pixels],
    ramps: Mapping[str, RampLight],
    context: BuildContext,
) -> Contribution:
    """Return the finished animations of one fire."""
    if isinstance(opened, Mapping) and recipe.phases != "none":
        from fire_atlas.pipeline.animation.change_phase import animate_in_phases

        return animate_in_phases(recipe, recipe.phases, opened, cells, ramps, context)
    if isinstance(opened, Mapping):
        return animate_views(recipe, opened, cells, ramps, context)
    if isinstance(opened, FireInWind):
        from fire_atlas.pipeline.animation.change_wind import animate_in_wind

        return animate_in_wind(recipe, opened, cells, ramps, context)
    from fire_atlas.pipeline.animation.pack_only import pack_only

    return pack_only(recipe, opened, context)


def prepared(
    loaded: LoadedRecipe, opened: Opened, recipes: int, context: BuildContext
) -> Iterator[tuple[str, PreparedView]]:
    """Yield the loops or views of a recipe's fires, ready to be analysed, by their names on the
    pages that ``recipes`` share."""
    recipe, first = loaded.recipe, None
    if recipe.variants == 1:
        for view in _prepared(recipe, opened, context):
            yield animation_title(view.name, recipe.name, [view.name], recipes), view
        return
    for variant in variants_of(loaded, opened, context):
        own = as_first(variant.recipe, first) if first else variant.recipe
        for view in _prepared(own, variant.opened, variant.context):
            first = first or view.recipe
            name = variant_title(variant.number, "" if view.name == recipe.name else view.name)
            yield animation_title(name, recipe.name, [name], recipes), view


def _prepared(recipe: Recipe, opened: Opened, context: BuildContext) -> Iterator[PreparedView]:
    if isinstance(opened, FireInWind):
        from fire_atlas.pipeline.animation.change_wind import prepared_winds

        return prepared_winds(recipe, opened, context)
    assert isinstance(opened, Mapping), "sprites have no field"
    return prepared_views(recipe, opened, context)
