"""Kind of source → clip. A new source is one new module and one case here."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, assert_never

from fire_atlas.recipe.source import FramesSource

if TYPE_CHECKING:
    from fire_atlas.core.clip import Clip
    from fire_atlas.sources.sprites import Sprites


def open_source(settings: FramesSource, path: Path, blend_space: str) -> Clip:
    """Open the fire that a recipe names.

    Args:
        settings: The recipe's ``source``; its type decides how the fire is made.
        path: What the source reads, absolute; may be a glob.
        blend_space: ``srgb`` or ``linear``: how the client of the atlas blends.

    Raises:
        SourceError: The input is missing, broken, too large or not what the settings say.
    """
    match settings:
        case FramesSource():
            from fire_atlas.sources.frames import open_frames

            return open_frames(settings, path, blend_space)
        case _:
            assert_never(settings)


def open_sprites(settings: FramesSource, path: Path, blend_space: str, name: str) -> Sprites | None:
    """Open what a recipe that only packs names, if that is more than the frames of one clip.

    Args as of ``open_source``; ``name`` is what sprites are called whose files have none.
    """
    match settings:
        case FramesSource():
            from fire_atlas.sources.sprites import open_sprites as open_images

            return open_images(settings, path, blend_space, name)
        case _:
            assert_never(settings)
