"""Animate what a recipe's source gives: views of a fire, a fire in several winds, or sprites."""

from collections.abc import Iterator, Mapping, Sequence

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.fire_in_wind import FireInWind
from fire_atlas.core.pixels import Pixels
from fire_atlas.heat.ready import RampLight
from fire_atlas.pipeline.animation.animate import PreparedView, animate_views, prepared_views
from fire_atlas.pipeline.animation.contribution import Contribution, animation_title
from fire_atlas.pipeline.input.open import Opened
from fire_atlas.recipe.models import Recipe


def contribute(
    recipe: Recipe,
    opened: Opened,
    cells: Sequence[Pixels],
    ramps: Mapping[str, RampLight],
    context: BuildContext,
) -> Contribution:
    """Return the finished animations of a recipe; ``cells`` are those of its flakes' texture,
    ``ramps`` the colours of its fire, as from ``open_ramps``."""
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
    recipe: Recipe, opened: Mapping[str, Clip] | FireInWind, recipes: int, context: BuildContext
) -> Iterator[tuple[str, PreparedView]]:
    """Yield the loops or views of a recipe, ready to be analysed, by their names on the pages that
    ``recipes`` share."""
    if isinstance(opened, FireInWind):
        from fire_atlas.pipeline.animation.change_wind import prepared_winds

        for view in prepared_winds(recipe, opened, context):
            yield view.name, view
        return
    for view in prepared_views(recipe, opened, context):
        yield animation_title(view.name, recipe.name, opened, recipes), view
