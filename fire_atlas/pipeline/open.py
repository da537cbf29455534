"""Open what a recipe names as its source: footage, sprites, or fire that is generated."""

from collections.abc import Mapping

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.digest import HashedFile
from fire_atlas.outputs.staging import Staging
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


def open_alone(loaded: LoadedRecipe) -> Mapping[str, Clip] | Sprites:
    """Open a recipe's source outside of a build, to look at its frames."""
    with Workers(1) as workers:
        return open_input(loaded, BuildContext.silent(workers))


def hash_inputs(
    opened: Mapping[str, Clip] | Sprites, loaded: LoadedRecipe, staging: Staging, workers: Workers
) -> list[HashedFile]:
    """Hash the files of an opened source, which no output may overwrite, nor the recipe's own.

    They are hashed before their frames are read: what changes meanwhile is not up to date
    afterwards.
    """
    files = _first(opened).inputs
    staging.keep([*files, *loaded.tree.files])
    return list(workers.map(HashedFile.of, files))


def hash_templates(loaded: LoadedRecipe, staging: Staging, workers: Workers) -> list[HashedFile]:
    """Hash the user's own templates, which no output may overwrite, nor the recipe's own files."""
    files = list(loaded.templates.values())
    staging.keep([*files, *loaded.tree.files])
    return list(workers.map(HashedFile.of, files))


def _first(opened: Mapping[str, Clip] | Sprites) -> Clip | Sprites:
    """Return the sprites, or the first of the clips: all views have the same files and matte."""
    return next(iter(opened.values())) if isinstance(opened, Mapping) else opened
