"""From sprites to pages: decide the layout, then draw one page at a time."""

from collections.abc import Sequence

import numpy as np

from fire_atlas.atlas.layout import AtlasSheet, Page, Region, Sprite
from fire_atlas.atlas.pack import Place, pack
from fire_atlas.atlas.trim import Box, Trim, boxes
from fire_atlas.core.pixels import Bytes
from fire_atlas.recipe.output import Atlas

BOTTOM_CENTRE = (0.5, 1.0)
"""Where fire stands, in 0..1 of the untrimmed frame, y down."""


def lay_out(
    name: str,
    sprites: Sequence[Sprite],
    *,
    frame_size: tuple[int, int],
    fps: float,
    settings: Atlas,
    anchor: tuple[float, float] = BOTTOM_CENTRE,
) -> AtlasSheet:
    """Return the sheet of one animation ``name``; ``frame_size`` is (width, height), untrimmed."""
    parts = boxes(sprites, _trim_of(settings), *frame_size)
    sizes = [(part.width, part.height) for part in parts]
    packing = pack(sizes, settings.max_size, settings.padding, settings.layout)
    names = _frame_names(name, len(sprites))
    duration = 1000 / fps
    return AtlasSheet(
        name=name,
        frame_width=frame_size[0],
        frame_height=frame_size[1],
        anchor=anchor,
        fps=fps,
        alpha=settings.alpha,
        blend_space=settings.blend_space,
        pages=tuple(
            Page(page_file(name, i), width, height)
            for i, (width, height) in enumerate(packing.pages)
        ),
        regions=tuple(map(_region, names, packing.places, parts, [duration] * len(names))),
        animations={name: names},
    )


def page_file(name: str, page: int, suffix: str = ".png") -> str:
    """Return the file name of a page, or of what describes it: ``fire.png``, ``fire-1.png``, ..."""
    return f"{name}-{page}{suffix}" if page else f"{name}{suffix}"


def draw_page(sheet: AtlasSheet, page: int, sprites: Sequence[Sprite]) -> Bytes:
    """Draw one page, (H, W, 4) uint8, with the sprites the sheet was laid out for, in order."""
    image = np.zeros((sheet.pages[page].height, sheet.pages[page].width, 4), np.uint8)
    for region, sprite in zip(sheet.regions, sprites, strict=True):
        if region.page == page and sprite.image.any():
            height, width = sprite.image.shape[:2]
            x = region.x + sprite.x - region.trim_x
            y = region.y + sprite.y - region.trim_y
            image[y : y + height, x : x + width] = sprite.image
    return image


def _trim_of(settings: Atlas) -> Trim:
    """Return how frames are trimmed. Every cell of a grid must show the same part of its frame.

    A flipbook plays cell after cell and knows no offsets: cut frame by frame it would jitter.
    """
    if settings.layout == "grid" and settings.trim == "frame":
        return "animation"
    return settings.trim


def _frame_names(name: str, count: int) -> tuple[str, ...]:
    digits = max(4, len(str(count - 1)))
    return tuple(f"{name}/{i:0{digits}}" for i in range(count))


def _region(name: str, place: Place, part: Box, duration: float) -> Region:
    return Region(
        name=name,
        page=place.page,
        x=place.x,
        y=place.y,
        width=part.width,
        height=part.height,
        trim_x=part.x,
        trim_y=part.y,
        duration=duration,
    )
