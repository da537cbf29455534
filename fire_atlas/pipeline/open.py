"""Open what a recipe names as its source: footage, sprites, or fire that is generated."""

from collections.abc import Mapping
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.pipeline.animate import has_effect
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.sources.registry import SourceSettings, open_source, open_sprites
from fire_atlas.sources.sprites import Sprites


def open_input(loaded: LoadedRecipe, context: BuildContext) -> Mapping[str, Clip] | Sprites:
    """Open a recipe's source.

    Returns:
        Clips by the name of their animation, one for each view; or sprites, where the recipe only
        packs images that are several animations or of several sizes.
    """
    settings = SourceSettings.of(loaded)
    sprites = None if has_effect(loaded.recipe) else open_sprites(settings)
    opened = open_source(settings, context.workers) if sprites is None else sprites
    first = _first(opened)
    context.progress.note(f"{first.matte} matte: {first.matte_reason}")
    return opened


def files_of(opened: Mapping[str, Clip] | Sprites) -> tuple[Path, ...]:
    """Return the files that were opened, in order."""
    return _first(opened).inputs


def _first(opened: Mapping[str, Clip] | Sprites) -> Clip | Sprites:
    """Return the sprites, or the first of the clips: all views have the same files and matte."""
    return next(iter(opened.values())) if isinstance(opened, Mapping) else opened
