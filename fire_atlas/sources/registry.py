"""Open fire of any kind as clips. A new kind needs a new module and a case here."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, assert_never

from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource, ProfileSource, SpritesSource

if TYPE_CHECKING:
    from fire_atlas.core.clip import Clip
    from fire_atlas.core.fire_in_wind import FireInWind
    from fire_atlas.core.progress import Progress
    from fire_atlas.core.workers import Workers
    from fire_atlas.recipe.load import LoadedRecipe
    from fire_atlas.recipe.models import Recipe
    from fire_atlas.sources.frames import Footage
    from fire_atlas.sources.reader import OpeningContext


def open_source(
    loaded: LoadedRecipe,
    workers: Workers,
    max_pixels: int = MAX_PIXELS,
    progress: Progress | None = None,
) -> dict[str, Clip]:
    """Open the clip of a recipe's source, or generate its clips in the wind of the recipe.

    Args:
        loaded: The recipe.
        workers: Pool that measures the frames of a clip to learn from.
        max_pixels: Limit on the pixels of a picture.
        progress: Counts frames of a video that are decoded, and of a fire that is simulated.

    Returns:
        Clips by the name of their animation: one with the recipe's name, or one for each of its
        ``views``. Generated frames are cached, since several steps of a build read them.

    Raises:
        SourceError: The input is missing, broken, too large, or does not fit the settings.
        RecipeError: The settings of a generated fire exceed a limit.
    """
    from fire_atlas.core.clip import kept
    from fire_atlas.sources.framing import PageLimit

    recipe, files = loaded.recipe, loaded.source_files
    source, context = _source(recipe), _context(recipe, workers, max_pixels)
    if progress is not None:
        context = replace(context, progress=progress)
    match source:
        case FramesSource():
            from fire_atlas.sources.frames import open_frames

            page = PageLimit(recipe.atlas.max_size, recipe.timeline)
            path = files[("source", "path")]
            return {recipe.name: open_frames(source, path, replace(context, page=page))}
        case ProfileSource():
            from fire_atlas.sources.profile import open_profile

            settings = GenerationSettings.of(recipe)
            clips = [*map(kept, open_profile(source, tuple(files.values()), settings, context))]
        case SilkSource():
            from fire_atlas.sources.silk import open_silk

            clips = [*map(kept, open_silk(source, files, GenerationSettings.of(recipe), context))]
        case FluidSource():
            from fire_atlas.sources.fluid import open_fluid

            clips = open_fluid(source, GenerationSettings.of(recipe), context)
        case _:
            assert_never(source)
    names = [f"view_{k}" for k in range(len(clips))] if len(clips) > 1 else [recipe.name]
    return dict(zip(names, clips, strict=True))


def open_source_in_wind(
    loaded: LoadedRecipe, workers: Workers, max_pixels: int = MAX_PIXELS
) -> FireInWind:
    """Generate the fire of a source in each of the winds of ``wind.levels``; see ``open_source``.

    Raises:
        ValueError: The source is a clip, which shows one wind.
    """
    from fire_atlas.core.clip import kept

    recipe, files = loaded.recipe, loaded.source_files
    source, context = _source(recipe), _context(recipe, workers, max_pixels)
    if isinstance(source, ProfileSource):
        from fire_atlas.sources.profile import open_profile_in_wind

        fire = open_profile_in_wind(
            source, tuple(files.values()), GenerationSettings.of(recipe), context
        )
    elif isinstance(source, SilkSource):
        from fire_atlas.sources.silk import open_silk_in_wind

        fire = open_silk_in_wind(source, files, GenerationSettings.of(recipe), context)
    else:
        raise ValueError("a clip shows one wind")
    return replace(fire, loops=tuple(map(kept, fire.loops)))


def examine_source(loaded: LoadedRecipe, workers: Workers, max_pixels: int = MAX_PIXELS) -> Footage:
    """Return what is known of a recipe's source before its first frame is decoded or generated.

    For arguments and errors see ``open_source``: all that it refuses before that is refused here.
    """
    recipe, files = loaded.recipe, loaded.source_files
    source, context = _source(recipe), _context(recipe, workers, max_pixels)
    match source:
        case FramesSource():
            from fire_atlas.sources.frames import examine_frames
            from fire_atlas.sources.framing import PageLimit

            path = files[("source", "path")]
            page = PageLimit(recipe.atlas.max_size, recipe.timeline)
            return examine_frames(source, path, replace(context, page=page))
        case ProfileSource():
            from fire_atlas.sources.profile import examine_profile

            return examine_profile(
                source, tuple(files.values()), GenerationSettings.of(recipe), context
            )
        case SilkSource():
            from fire_atlas.sources.silk import examine_silk

            return examine_silk(source, files, GenerationSettings.of(recipe), context)
        case FluidSource():
            from fire_atlas.sources.fluid import examine_fluid

            return examine_fluid(source, GenerationSettings.of(recipe))
        case _:
            assert_never(source)


def _source(recipe: Recipe) -> FramesSource | ProfileSource | SilkSource | FluidSource:
    """Return the source of a recipe that has fire.

    Raises:
        ValueError: It has none: only members bring its clips; or sprites, which are none.
    """
    if recipe.source is None or isinstance(recipe.source, SpritesSource):
        raise ValueError("only a recipe with fire brings clips")
    return recipe.source


def _context(recipe: Recipe, workers: Workers, max_pixels: int) -> OpeningContext:
    from fire_atlas.sources.reader import OpeningContext

    return OpeningContext(recipe.atlas.blend_space, workers, max_pixels=max_pixels)
