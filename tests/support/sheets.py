"""Sheets for exporters to describe, made as a build makes them."""

from typing import Any

import numpy as np

from fire_atlas.atlas.mesh import with_meshes
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames, AtlasSheet, Sprite
from fire_atlas.atlas.trim import trimmed
from fire_atlas.formats.product import Product
from fire_atlas.recipe.output import Atlas

FRAME = 60
"""Side of an untrimmed frame, px."""


def sprite_of(width: int, height: int, x: int = 5, y: int = 3, value: int = 1) -> Sprite:
    return trimmed(np.full((height, width, 4), value, np.uint8), x, y, (FRAME, FRAME))


def product_of(*sheets: AtlasSheet) -> Product:
    """What a build made that has no flakes, in an empty folder."""
    return Product(sheets, {}, frozenset(), lambda name: None)


def animation_of(
    sizes: list[tuple[int, int]], name: str = "campfire", *, loop: bool = True, seed: int = 0
) -> AnimationFrames:
    """An animation of full sprites of these (width, height), at (5, 3) of a 60 × 60 frame."""
    sprites = tuple(
        sprite_of(w, h, value=(20 * seed + i) % 250 + 1) for i, (w, h) in enumerate(sizes)
    )
    return AnimationFrames(name, sprites, 1000 / 24, loop, (30, 54))


def sheet_of(sizes: list[tuple[int, int]], **settings: Any) -> AtlasSheet:
    return sheets_of(sizes, **settings)[0]


def sheets_of(sizes: list[tuple[int, int]], **settings: Any) -> tuple[AtlasSheet, ...]:
    return build_sheets("campfire", [animation_of(sizes)], Atlas.model_validate(settings))


def sheet_of_fire(**settings: Any) -> AtlasSheet:
    """Nine frames of differing sizes; the fifth is empty, the last is the first again."""
    rng = np.random.default_rng(2)
    sprites = [
        trimmed(np.full((int(h), int(w), 4), 90 + i, np.uint8), int(x), int(y), (FRAME, FRAME))
        for i, (w, h, x, y) in enumerate(rng.integers(8, 30, (8, 4)))
    ]
    sprites[4] = trimmed(np.zeros((1, 1, 4), np.uint8), 0, 0, (FRAME, FRAME))
    animation = AnimationFrames("campfire", (*sprites, sprites[0]), 1000 / 24, True, (30, 54))
    return build_sheets("campfire", [animation], Atlas.model_validate(settings))[0]


def sparks_and_others() -> list[Sprite]:
    """Frames of meshes: four of sparks, one that is full, an empty one, the first once more."""
    rng = np.random.default_rng(3)
    images = [np.zeros((26, 40, 4), np.uint8) for _ in range(6)]
    for i, image in enumerate(images[:4]):
        image[3:22, 5 : 24 + i] = rng.random((19, 19 + i, 1)) < 0.1
    images[4][:] = 7
    return [trimmed(image) for image in (*images, images[0])]


def sheet_with_meshes(sprites: list[Sprite], **settings: Any) -> AtlasSheet:
    """The sheet of an animation whose frames have meshes of up to seven vertices."""
    animation = AnimationFrames("fire", tuple(sprites), 40.0, True, None)
    sheet = build_sheets("fire", [animation], Atlas.model_validate(settings))[0]
    return with_meshes(sheet, [[each] for each in sprites], 7)
