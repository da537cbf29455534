"""Open what a recipe names as its source: footage, sprites, or fire that is generated."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.dependencies import inputs_of, recipe_files
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
    settings = SourceSettings.of(loaded, context.most_pixels)
    sprites = None if has_effect(loaded.recipe) else open_sprites(settings)
    opened = open_source(settings, context.workers) if sprites is None else sprites
    first = _first(opened)
    context.progress.note(f"{first.matte} matte: {first.matte_reason}")
    return opened


def open_alone(loaded: LoadedRecipe, most_pixels: int) -> Mapping[str, Clip] | Sprites:
    """Open a recipe's source outside of a build, to look at its frames."""
    with Workers(1) as workers:
        return open_input(loaded, BuildContext.silent(workers, most_pixels))


def hash_inputs(loaded: LoadedRecipe, staging: Staging, workers: Workers) -> list[HashedFile]:
    """Hash every file that sources and templates stand for, before anything of them is read.

    No output may overwrite them, nor the files of the recipes. What changes from now on is not up
    to date afterwards: the manifest says so of a file that was touched when all has been read.

    Raises:
        SourceError: One is missing, or cannot be read.
    """
    files = inputs_of(loaded.tree)
    staging.keep([*files, *recipe_files(loaded.tree)])
    return list(workers.map(HashedFile.of, files))


def input_files(opened: Mapping[str, Clip] | Sprites) -> tuple[Path, ...]:
    """Return the files that an opened source is read from, in order."""
    return _first(opened).inputs


def check_inputs(
    hashed: Sequence[HashedFile],
    opened: Sequence[Path],
    loaded: LoadedRecipe,
    context: BuildContext,
) -> None:
    """Look back, when all inputs have been read, at whether they are those that were hashed.

    ``opened`` are the files of all sources, in order. The user is told of files that were written.

    Raises:
        SourceError: Sources were opened with other files than those: some came or went.
    """
    files = [*opened, *loaded.templates.values()]
    expected = [file.path for file in hashed]
    if files != expected:
        other = next(iter(set(files).symmetric_difference(expected)), loaded.path)
        raise SourceError(f"{other}: came or went while the sources were opened; build again")
    for file in hashed:
        if not file.is_unchanged():
            context.progress.note(f"{file.path}: changed while it was read; build again")


def _first(opened: Mapping[str, Clip] | Sprites) -> Clip | Sprites:
    """Return the sprites, or the first of the clips: all views have the same files and matte."""
    return next(iter(opened.values())) if isinstance(opened, Mapping) else opened
