"""Open a source of any kind as clips. A new kind needs a new module and a case here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, assert_never

from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource, ProfileSource
from fire_atlas.recipe.timeline import Timeline

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fire_atlas.core.clip import Clip
    from fire_atlas.core.fire_in_wind import FireInWind
    from fire_atlas.core.workers import Workers
    from fire_atlas.recipe.load import LoadedRecipe
    from fire_atlas.sources.reader import OpeningContext
    from fire_atlas.sources.sprites import Sprites


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """The parts of a recipe that are needed to open its source.

    Attributes:
        name: Name of the recipe, and of its animation if there is only one.
        source: The recipe's ``source``, of any kind.
        files: Absolute path (or glob) of each file of the source, by its key.
        generation: Settings of generated fire.
        blend_space: Encoding in which the client blends, for the luminance matte.
        timeline, max_page: How many frames are shown, and the size of a page, px: a large video is
            reduced until its frames fit.
        max_pixels: Limit on the pixels of a picture.
    """

    name: str
    source: FramesSource | ProfileSource | SilkSource
    files: Mapping[tuple[str, ...], Path]
    generation: GenerationSettings
    blend_space: str
    timeline: Timeline
    max_page: int
    max_pixels: int

    @classmethod
    def of(cls, loaded: LoadedRecipe, max_pixels: int = MAX_PIXELS) -> SourceSettings:
        """Return the settings of a recipe that has a source."""
        recipe = loaded.recipe
        if recipe.source is None:
            raise ValueError("only a recipe with a source brings clips")
        generation = GenerationSettings.of(recipe)
        return cls(
            recipe.name,
            recipe.source,
            loaded.source_files,
            generation,
            recipe.atlas.blend_space,
            recipe.timeline,
            recipe.atlas.max_size,
            max_pixels,
        )


def open_source(settings: SourceSettings, workers: Workers) -> dict[str, Clip]:
    """Open the clip of a source, or generate its clips in the wind of the recipe.

    Args:
        settings: The source and related settings.
        workers: Pool that measures the frames of a clip to learn from.

    Returns:
        Clips by the name of their animation: one with the recipe's name, or one for each of its
        ``views``. Generated frames are cached, since several steps of a build read them.

    Raises:
        SourceError: The input is missing, broken, too large, or does not fit the settings.
        RecipeError: The settings of a generated fire exceed a limit.
    """
    from fire_atlas.core.clip import kept
    from fire_atlas.sources.framing import PageLimit

    source, files = settings.source, settings.files
    context = _context(settings, workers)
    match source:
        case FramesSource():
            from fire_atlas.sources.frames import open_frames

            page = PageLimit(settings.max_page, settings.timeline)
            path = files[("source", "path")]
            return {settings.name: open_frames(source, path, replace(context, page=page))}
        case ProfileSource():
            from fire_atlas.sources.profile import open_profile

            clips = open_profile(source, tuple(files.values()), settings.generation, context)
        case SilkSource():
            from fire_atlas.sources.silk import open_silk

            texture = files.get(("source", "texture", "path"))
            clips = open_silk(source, texture, settings.generation, context)
        case _:
            assert_never(source)
    names = [f"view_{k}" for k in range(len(clips))] if len(clips) > 1 else [settings.name]
    return dict(zip(names, map(kept, clips), strict=True))


def open_source_in_wind(settings: SourceSettings, workers: Workers) -> FireInWind:
    """Generate the fire of a source in each of the winds of ``wind.levels``; see ``open_source``.

    Raises:
        ValueError: The source is a clip, which shows one wind.
    """
    from fire_atlas.core.clip import kept

    source, files, context = settings.source, settings.files, _context(settings, workers)
    if isinstance(source, ProfileSource):
        from fire_atlas.sources.profile import open_profile_in_wind

        fire = open_profile_in_wind(source, tuple(files.values()), settings.generation, context)
    elif isinstance(source, SilkSource):
        from fire_atlas.sources.silk import open_silk_in_wind

        texture = files.get(("source", "texture", "path"))
        fire = open_silk_in_wind(source, texture, settings.generation, context)
    else:
        raise ValueError("a clip shows one wind")
    return replace(fire, loops=tuple(map(kept, fire.loops)))


def _context(settings: SourceSettings, workers: Workers) -> OpeningContext:
    from fire_atlas.sources.reader import OpeningContext

    return OpeningContext(settings.blend_space, workers, max_pixels=settings.max_pixels)


def open_sprites(settings: SourceSettings) -> Sprites | None:
    """Open the sprites of a recipe that only packs; None if they are the frames of one clip."""
    if not isinstance(settings.source, FramesSource):
        return None
    from fire_atlas.sources.sprites import open_sprites as open_images

    path = settings.files[("source", "path")]
    return open_images(
        settings.source, path, settings.blend_space, settings.name, settings.max_pixels
    )
