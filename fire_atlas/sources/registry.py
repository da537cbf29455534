"""Open a source of any kind as clips. A new kind is one new module and one case here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, assert_never

from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import FramesSource, ProfileSource
from fire_atlas.sources.listing import MAX_PIXELS

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fire_atlas.core.clip import Clip
    from fire_atlas.core.workers import Workers
    from fire_atlas.recipe.load import LoadedRecipe
    from fire_atlas.sources.sprites import Sprites


@dataclass(frozen=True, slots=True)
class SourceSettings:
    """What opening a source reads of a recipe.

    Attributes:
        name: Of the recipe; its only animation is called so.
        source: The section; its type decides how the fire comes about.
        files: Absolute path (or glob) of each file the section names, by its key.
        generation: Settings of fire that is generated.
        blend_space: ``srgb`` or ``linear``: where the client blends, for the luminance matte.
        most_pixels: Larger pictures are refused.
    """

    name: str
    source: FramesSource | ProfileSource | SilkSource
    files: Mapping[tuple[str, ...], Path]
    generation: GenerationSettings
    blend_space: str
    most_pixels: int

    @classmethod
    def of(cls, loaded: LoadedRecipe, most_pixels: int = MAX_PIXELS) -> SourceSettings:
        """Return those of a recipe that has a source."""
        recipe = loaded.recipe
        if recipe.source is None:
            raise ValueError("only a recipe with a source brings clips")
        generation = GenerationSettings.of(recipe)
        space = recipe.atlas.blend_space
        return cls(recipe.name, recipe.source, loaded.source_files, generation, space, most_pixels)


def open_source(settings: SourceSettings, workers: Workers) -> dict[str, Clip]:
    """Open the fire that a recipe names, or generate it.

    Args:
        settings: What the recipe says.
        workers: Who looks at frames that have to be learnt from.

    Returns:
        Clips by the name of their animation: the recipe's own, or one for each of its ``views``.
        Frames that are generated are remembered, as far as there is room: each step asks again.

    Raises:
        SourceError: The input is missing, broken, too large or not what the settings say.
        RecipeError: A fire to be generated asks for more than can be done.
    """
    source, files, most = settings.source, settings.files, settings.most_pixels
    match source:
        case FramesSource():
            from fire_atlas.sources.frames import open_frames

            path = files[("source", "path")]
            return {settings.name: open_frames(source, path, settings.blend_space, most)}
        case ProfileSource():
            from fire_atlas.sources.profile import open_profile

            clips = open_profile(
                source,
                tuple(files.values()),
                settings.generation,
                settings.blend_space,
                workers,
                most,
            )
        case SilkSource():
            from fire_atlas.sources.silk import open_silk

            texture = files.get(("source", "texture", "path"))
            clips = open_silk(source, texture, settings.generation, settings.blend_space, most)
        case _:
            assert_never(source)
    from fire_atlas.core.clip import cached

    names = [f"view_{k}" for k in range(len(clips))] if len(clips) > 1 else [settings.name]
    kept = (replace(clip, picture=cached(clip.picture, range(clip.count))) for clip in clips)
    return dict(zip(names, kept, strict=True))


def open_sprites(settings: SourceSettings) -> Sprites | None:
    """Open what a recipe that only packs names, if that is more than the frames of one clip."""
    if not isinstance(settings.source, FramesSource):
        return None
    from fire_atlas.sources.sprites import open_sprites as open_images

    path = settings.files[("source", "path")]
    return open_images(
        settings.source, path, settings.blend_space, settings.name, settings.most_pixels
    )
