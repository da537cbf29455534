"""Hash and open the inputs of a recipe: footage, sprites, or generated fire."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.workers import Workers
from fire_atlas.outputs.dependencies import inputs_of, recipe_files
from fire_atlas.outputs.digest import HashedFile
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources.registry import SourceSettings, open_source, open_sprites
from fire_atlas.sources.sheet import likely_grid
from fire_atlas.sources.sprites import Sprites


def open_input(loaded: LoadedRecipe, context: BuildContext) -> Mapping[str, Clip] | Sprites:
    """Open a recipe's source.

    Returns:
        Clips by the name of their animation, one for each view; or sprites, if the recipe only
        packs images of several animations or sizes.
    """
    settings = SourceSettings.of(loaded, context.max_pixels)
    sprites = None if loaded.recipe.has_effect else open_sprites(settings)
    opened = open_source(settings, context.workers) if sprites is None else sprites
    first = _first(opened)
    context.progress.note(f"{first.matte} matte: {first.matte_reason}")
    if isinstance(first, Clip):
        for note in first.notes:
            context.progress.note(note)
        if _is_one_picture(loaded, first):
            _note_likely_sheet(first, context)
    return opened


def _is_one_picture(loaded: LoadedRecipe, clip: Clip) -> bool:
    """Whether a clip is one whole image file, not a frame that was chosen from several."""
    source = loaded.recipe.source
    return clip.count == 1 and isinstance(source, FramesSource) and source.grid is None


def _note_likely_sheet(clip: Clip, context: BuildContext) -> None:
    if found := likely_grid(clip.read(0)[..., 3]):
        columns, rows = found
        context.progress.note(
            f"{clip.inputs[0].name} looks like a sheet of {columns} x {rows} frames, but is read "
            f"as one; if it is a sheet, set source.grid: {{columns: {columns}, rows: {rows}}}"
        )


def open_alone(loaded: LoadedRecipe, max_pixels: int) -> Mapping[str, Clip] | Sprites:
    """Open a recipe's source outside of a build, to read its frames."""
    with Workers(1) as workers:
        return open_input(loaded, BuildContext.silent(workers, max_pixels))


def hash_inputs(loaded: LoadedRecipe, staging: Staging, workers: Workers) -> list[HashedFile]:
    """Hash every source and template file before any of them is opened.

    Also protects these files and the recipes from being overwritten by outputs. A file that changes
    from now on makes the build stale, because the manifest has the hash taken here.

    Raises:
        SourceError: A file is missing, or cannot be read.
    """
    files = inputs_of(loaded.tree)
    staging.protect([*files, *recipe_files(loaded.tree)])
    return list(workers.map(HashedFile.of, files))


def input_files(opened: Mapping[str, Clip] | Sprites) -> tuple[Path, ...]:
    """Return the files of an opened source, in playing order."""
    return _first(opened).inputs


def check_inputs(
    hashed: Sequence[HashedFile],
    opened: Sequence[Path],
    loaded: LoadedRecipe,
    context: BuildContext,
) -> None:
    """Check after all inputs were read that none has changed since it was hashed.

    ``opened`` are the files of all sources, in order. A note names each file that has changed.

    Raises:
        SourceError: Files were added to sources or removed.
    """
    files = [*opened, *loaded.templates.values()]
    expected = [file.path for file in hashed]
    if files != expected:
        other = next(iter(set(files).symmetric_difference(expected)), loaded.path)
        raise SourceError(f"{other}: was added or removed during the build; build again")
    for file in hashed:
        if not file.is_unchanged():
            context.progress.note(f"{file.path}: changed while it was read; build again")


def _first(opened: Mapping[str, Clip] | Sprites) -> Clip | Sprites:
    """Return the sprites, or the first clip: all views have the same files and matte."""
    return next(iter(opened.values())) if isinstance(opened, Mapping) else opened
