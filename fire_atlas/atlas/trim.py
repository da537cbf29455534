"""Cut what is empty. Pixels are cut once, tightly; what a recipe's ``trim`` means is boxes."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import Rect, Sprite
from fire_atlas.core.pixels import Bytes

Trim = Literal["frame", "animation", "none"]

_CORNER = Rect(0, 0, 1, 1)
"""What is left of a frame that trims to nothing."""


def lit_box(image: Bytes) -> Rect | None:
    """Return the smallest box around all pixels of (H, W, 4) with any channel above 0, if any.

    Alpha alone will not do: the pixels of an additive page have none.
    """
    return _box(np.ascontiguousarray(image).view(np.uint32)[..., 0])


def visible_box(image: Bytes, threshold: int) -> Rect | None:
    """Return the smallest box around all pixels of (H, W, 4) that show, if any do.

    A pixel shows by its alpha or, on pages that add light, by its light: more than ``threshold``.
    """
    if not threshold:
        return lit_box(image)
    straight = image[..., 3].any()
    seen = image[..., 3] if straight else image.max(axis=2)
    return _box((seen > threshold).astype(np.uint8))


def trimmed(
    image: Bytes,
    x: int = 0,
    y: int = 0,
    frame_size: tuple[int, int] | None = None,
    threshold: int = 0,
) -> Sprite:
    """Return the lit part of ``image`` (H, W, 4), which lies at (x, y) of its frame.

    The sprite owns its pixels, so that the image can go. ``frame_size`` is (width, height), by
    default that of the image.
    """
    frame_size = frame_size or (image.shape[1], image.shape[0])
    box = lit_box(image)
    if box is None:
        return Sprite(np.zeros((1, 1, 4), np.uint8), 0, 0, *frame_size, None)
    lit = image[box.y : box.y + box.height, box.x : box.x + box.width]
    lit = lit.copy() if lit.size < image.size else image
    x, y = x + box.x, y + box.y
    visible = visible_box(lit, threshold)
    if visible is not None:
        visible = visible._replace(x=x + visible.x, y=y + visible.y)
    return Sprite(lit, x, y, *frame_size, visible)


def boxes(sprites: Sequence[Sprite], trim: Trim, grid: int = 1, margin: int = 0) -> list[Rect]:
    """Return which part of its frame each sprite's region shows; multiples of ``grid`` px.

    Where it is cut, ``margin`` px are left around what is lit, as far as the frame has them.
    """
    if trim == "none":
        whole = [Rect(0, 0, sprite.frame_width, sprite.frame_height) for sprite in sprites]
        return [_on_grid(box, grid) for box in whole]
    lit = [_grown(sprite, margin) for sprite in sprites]
    if trim == "frame":
        return [_on_grid(box or _CORNER, grid) for box in lit]
    some = [box for box in lit if box]
    return [_on_grid(around(some) if some else _CORNER, grid)] * len(sprites)


def _grown(sprite: Sprite, margin: int) -> Rect | None:
    if sprite.lit is None:
        return None
    x, y = max(sprite.lit.x - margin, 0), max(sprite.lit.y - margin, 0)
    right = min(sprite.lit.x + sprite.lit.width + margin, sprite.frame_width)
    bottom = min(sprite.lit.y + sprite.lit.height + margin, sprite.frame_height)
    return Rect(x, y, right - x, bottom - y)


def cell(sprite: Sprite, box: Rect) -> Bytes:
    """Return the pixels of a ``box`` of the sprite's frame, (h, w, 4) uint8."""
    image, x, y = part_of(sprite, box)
    whole = np.zeros((box.height, box.width, 4), np.uint8)
    whole[y : y + image.shape[0], x : x + image.shape[1]] = image
    return whole


def part_of(sprite: Sprite, box: Rect) -> tuple[Bytes, int, int]:
    """Return what a ``box`` of the frame shows of the sprite, and where in the box that is, px."""
    left, top = max(box.x - sprite.x, 0), max(box.y - sprite.y, 0)
    right, bottom = box.x + box.width - sprite.x, box.y + box.height - sprite.y
    image = sprite.image[top : max(bottom, top), left : max(right, left)]
    return image, max(sprite.x - box.x, 0), max(sprite.y - box.y, 0)


def _box(mask: NDArray[np.unsignedinteger]) -> Rect | None:
    rows = np.flatnonzero(np.bitwise_or.reduce(mask, axis=1))
    if not rows.size:
        return None
    columns = np.flatnonzero(np.bitwise_or.reduce(mask[rows[0] : rows[-1] + 1], axis=0))
    x, y = int(columns[0]), int(rows[0])
    return Rect(x, y, int(columns[-1]) + 1 - x, int(rows[-1]) + 1 - y)


def around(parts: Sequence[Rect]) -> Rect:
    """Return the smallest box around all ``parts``, one at least."""
    x, y = min(box.x for box in parts), min(box.y for box in parts)
    right = max(box.x + box.width for box in parts)
    bottom = max(box.y + box.height for box in parts)
    return Rect(x, y, right - x, bottom - y)


def _on_grid(box: Rect, grid: int) -> Rect:
    """Return the smallest box around ``box`` whose corners are on multiples of ``grid``."""
    x, y = box.x // grid * grid, box.y // grid * grid
    right, bottom = box.x + box.width, box.y + box.height
    return Rect(x, y, up_to(grid, right) - x, up_to(grid, bottom) - y)


def up_to(grid: int, length: int) -> int:
    """Return the smallest multiple of ``grid`` that is at least ``length``."""
    return -(-length // grid) * grid
