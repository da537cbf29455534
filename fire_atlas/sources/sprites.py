"""Source ``sprites``: open pictures of any sizes under their own names, for packing alone."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from fire_atlas.core.named_sprite import NamedSprite
from fire_atlas.core.picture import Picture, to_light, with_alpha
from fire_atlas.core.workers import Workers
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.problem import Problem
from fire_atlas.recipe.validate import refusal
from fire_atlas.sources.frames import DEFAULT_FPS
from fire_atlas.sources.images import decode, read_header, shared_notes
from fire_atlas.sources.nine_patch import split_nine_patch
from fire_atlas.sources.sprite_names import SpriteList, sprites_of, sprites_source

_MOST_NAMED = 12
"""Animations that a note names at most."""


@dataclass(frozen=True, slots=True)
class Sprites:
    """Pictures of any sizes, read on demand.

    Attributes:
        names: Their names and animations.
        rates: Frames per second of each animation.
        read: ``read(i)`` returns picture i, (H, W, 4) as ``Clip.picture``, and the sprite with its
            border.
        inputs: The files that are read, in order of the recipe's paths.
        notes: What was decided about them, and why, for the user.
    """

    names: SpriteList
    rates: Mapping[str, float]
    read: Callable[[int], tuple[Picture, NamedSprite]]
    inputs: tuple[Path, ...]
    notes: tuple[str, ...]


def open_sprites(loaded: LoadedRecipe, workers: Workers, max_pixels: int = MAX_PIXELS) -> Sprites:
    """Open the sprites of a recipe.

    Raises:
        SourceError: There are none, an image is broken or too large, or two have one name.
        RecipeError: A key names no sprite, or states a border that is larger than it.
    """
    names = sprites_of(loaded)
    source, paths = sprites_source(loaded), [file.path for file in names.files]
    check_borders(loaded, names, max_pixels)
    headers = list(workers.map(lambda path: read_header(path, max_pixels), paths))

    def read(i: int) -> tuple[Picture, NamedSprite]:
        file = names.files[i]
        picture, sprite = decode(file.path, headers[i]), file.sprite
        if file.draws_border:
            picture, border = split_nine_patch(picture, file.path)
            sprite = replace(sprite, border=border)
        return with_alpha(picture) if picture.dtype.kind == "u" else to_light(picture), sprite

    return Sprites(
        names=names,
        rates={name: source.rates.get(name, DEFAULT_FPS) for name in names.animations},
        read=read,
        inputs=names.paths,
        notes=(
            *_animations(names),
            *names.notes,
            *shared_notes(dict(zip(paths, headers, strict=True))),
        ),
    )


def _animations(names: SpriteList) -> Iterator[str]:
    """Yield a note on the animations that were found."""
    found = [f"{name} ({len(frames)} frames)" for name, frames in names.animations.items()]
    if found:
        more = f" and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
        yield f"animations among the sprites: {', '.join(found[:_MOST_NAMED])}{more}"


def check_borders(loaded: LoadedRecipe, names: SpriteList, max_pixels: int = MAX_PIXELS) -> None:
    """Refuse borders that a recipe states and that are larger than their sprites.

    Raises:
        RecipeError: With each of them.
        SourceError: The image of one is unreadable or too large.
    """
    if problems := list(_too_large(names, max_pixels)):
        raise refusal(loaded.tree, problems)


def _too_large(names: SpriteList, max_pixels: int) -> Iterator[Problem]:
    for file in names.files:
        name, border = file.sprite.name, file.sprite.border
        if border is None:
            continue
        header = read_header(file.path, max_pixels)
        if border.left + border.right > header.width or border.top + border.bottom > header.height:
            yield Problem(
                ("source", "borders", name),
                f"is larger than the sprite {name}, which is {header.width}x{header.height}: it "
                f"is [left, top, right, bottom], px",
            )
