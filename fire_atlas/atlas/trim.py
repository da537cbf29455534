"""Cut what is empty. Pixels are cut once, tightly; what a recipe's ``trim`` means is boxes."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from fire_atlas.atlas.layout import Sprite
from fire_atlas.core.pixels import Bytes

Trim = Literal["frame", "animation", "none"]


class Box(NamedTuple):
    """A part of an untrimmed frame, px: top-left corner and size."""

    x: int
    y: int
    width: int
    height: int


def lit_box(image: Bytes) -> Box | None:
    """Return the smallest box around all pixels of (H, W, 4) with any channel above 0, if any.

    Alpha alone will not do: the pixels of an additive page have none.
    """
    words = np.ascontiguousarray(image).view(np.uint32)[..., 0]
    rows = np.flatnonzero(np.bitwise_or.reduce(words, axis=1))
    if not rows.size:
        return None
    columns = np.flatnonzero(np.bitwise_or.reduce(words[rows[0] : rows[-1] + 1], axis=0))
    x, y = int(columns[0]), int(rows[0])
    return Box(x, y, int(columns[-1]) + 1 - x, int(rows[-1]) + 1 - y)


def trimmed(image: Bytes, x: int = 0, y: int = 0) -> Sprite:
    """Return the lit part of ``image`` (H, W, 4), which lies at (x, y) of its frame.

    An empty image becomes one clear pixel at the frame's corner. The sprite owns its pixels, so
    that the image can go.
    """
    box = lit_box(image)
    if box is None:
        return Sprite(np.zeros((1, 1, 4), np.uint8), 0, 0)
    lit = image[box.y : box.y + box.height, box.x : box.x + box.width]
    return Sprite(lit.copy() if lit.size < image.size else image, x + box.x, y + box.y)


def boxes(sprites: Sequence[Sprite], trim: Trim, width: int, height: int) -> list[Box]:
    """Return which part of its ``width`` × ``height`` frame each sprite's region shows."""
    if trim == "none":
        return [Box(0, 0, width, height)] * len(sprites)
    own = [Box(s.x, s.y, s.image.shape[1], s.image.shape[0]) for s in sprites]
    if trim == "frame":
        return own
    lit = [box for box, sprite in zip(own, sprites, strict=True) if sprite.image.any()]
    return [_around(lit or own)] * len(sprites)


def _around(parts: Sequence[Box]) -> Box:
    x, y = min(box.x for box in parts), min(box.y for box in parts)
    right = max(box.x + box.width for box in parts)
    bottom = max(box.y + box.height for box in parts)
    return Box(x, y, right - x, bottom - y)
