"""Kind of source → clips. A new source is one new module and one case here."""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource, ProfileSource

if TYPE_CHECKING:
    from fire_atlas.core.clip import Clip
    from fire_atlas.core.workers import Workers
    from fire_atlas.recipe.load import LoadedRecipe
    from fire_atlas.sources.sprites import Sprites


def open_source(loaded: LoadedRecipe, workers: Workers) -> dict[str, Clip]:
    """Open the fire that a recipe names, or make it.

    Args:
        loaded: The recipe; the type of its ``source`` decides how the fire is made.
        workers: Who looks at frames that have to be learnt from.

    Returns:
        Clips by the name of their animation: the recipe's own, or one for each of its ``views``.

    Raises:
        SourceError: The input is missing, broken, too large or not what the settings say.
        RecipeError: A fire to be made asks for more than can be done.
    """
    recipe = loaded.recipe
    match recipe.source:
        case FramesSource() as settings:
            from fire_atlas.sources.frames import open_frames

            path = loaded.source_files[("source", "path")]
            return {recipe.name: open_frames(settings, path, recipe.atlas.blend_space)}
        case ProfileSource() as settings:
            from fire_atlas.sources.profile import open_profile

            return open_profile(recipe, settings, tuple(loaded.source_files.values()), workers)
        case SilkSource() as settings:
            from fire_atlas.sources.silk import open_silk

            texture = loaded.source_files.get(("source", "texture", "path"))
            return open_silk(settings, recipe, texture)
        case None:
            raise ValueError("only a recipe with a source brings clips")
        case _:
            assert_never(recipe.source)


def open_sprites(loaded: LoadedRecipe) -> Sprites | None:
    """Open what a recipe that only packs names, if that is more than the frames of one clip."""
    recipe = loaded.recipe
    if not isinstance(recipe.source, FramesSource):
        return None
    from fire_atlas.sources.sprites import open_sprites as open_images

    path = loaded.source_files[("source", "path")]
    return open_images(recipe.source, path, recipe.atlas.blend_space, recipe.name)
