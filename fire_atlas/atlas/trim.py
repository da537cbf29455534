"""Trim empty borders off frames. Sprites are cropped once, tightly; the recipe's ``trim`` then only
decides which rectangle of its frame a region shows."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import PlacedImage, Rect, Sprite
from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Bytes

Trim = Literal["frame", "animation", "none"]

_SINGLE_PIXEL = Rect(0, 0, 1, 1)
"""Rectangle of a frame in which nothing is visible."""


def lit_rect(image: Bytes) -> Rect | None:
    """Return the smallest rectangle around all pixels of (H, W, 4) with a channel above 0, if any.

    Alpha alone is not enough: it is 0 on additive pages.
    """
    return _extent(np.ascontiguousarray(image).view(np.uint32)[..., 0])


def visible_rect(image: Bytes, threshold: int, *, is_straight: bool = True) -> Rect | None:
    """Return the smallest rectangle around all visible pixels of (H, W, 4), if any; arguments as
    for ``visible_pixels``."""
    if not threshold:
        return lit_rect(image)
    return _extent(visible_pixels(image, threshold, is_straight=is_straight).view(np.uint8))


def visible_pixels(image: Bytes, threshold: int, *, is_straight: bool = True) -> NDArray[np.bool_]:
    """Return which pixels of (H, W, 4) are visible: (H, W).

    A pixel is visible if its alpha is above ``threshold`` or, unless the image ``is_straight``, its
    light, which then needs no alpha.
    """
    seen = image[..., 3]
    if not (threshold and is_straight):
        seen = np.maximum(seen, brightest(image))
    return np.asarray(seen > threshold)


def trimmed(
    image: Bytes,
    x: int = 0,
    y: int = 0,
    frame_size: tuple[int, int] | None = None,
    threshold: int = 0,
    *,
    is_straight: bool = True,
) -> Sprite:
    """Crop ``image`` (H, W, 4), which lies at (x, y) of its frame, to its lit part.

    The sprite has a copy of the pixels, so that the image can be freed. ``frame_size`` is (width,
    height), by default the image's; ``threshold`` and ``is_straight`` are as for
    ``visible_pixels``.
    """
    frame_size = frame_size or (image.shape[1], image.shape[0])
    rect = lit_rect(image)
    if rect is None:
        return Sprite(np.zeros((1, 1, 4), np.uint8), 0, 0, *frame_size, None)
    lit = image[rect.y : rect.y + rect.height, rect.x : rect.x + rect.width]
    lit = lit.copy() if lit.size < image.size else image
    x, y = x + rect.x, y + rect.y
    visible = visible_rect(lit, threshold, is_straight=is_straight)
    if visible is not None:
        visible = visible._replace(x=x + visible.x, y=y + visible.y)
    return Sprite(lit, x, y, *frame_size, visible)


def trim_rects(sprites: Sequence[Sprite], trim: Trim, unit: int = 1, margin: int = 0) -> list[Rect]:
    """Return the rectangle of its frame that each sprite's region shows, in multiples of ``unit``.

    Trimming keeps ``margin`` px around the visible part, as far as the frame has them.
    """
    if trim == "none":
        whole = [Rect(0, 0, sprite.frame_width, sprite.frame_height) for sprite in sprites]
        return [_on_grid(rect, unit) for rect in whole]
    lit = [_grown(sprite, margin) for sprite in sprites]
    if trim == "frame":
        return [_on_grid(rect or _SINGLE_PIXEL, unit) for rect in lit]
    some = [rect for rect in lit if rect]
    return [_on_grid(bounding_rect(some) if some else _SINGLE_PIXEL, unit)] * len(sprites)


def _grown(sprite: Sprite, margin: int) -> Rect | None:
    if sprite.visible is None:
        return None
    x, y = max(sprite.visible.x - margin, 0), max(sprite.visible.y - margin, 0)
    right = min(sprite.visible.x + sprite.visible.width + margin, sprite.frame_width)
    bottom = min(sprite.visible.y + sprite.visible.height + margin, sprite.frame_height)
    return Rect(x, y, right - x, bottom - y)


def crop(sprite: PlacedImage, rect: Rect) -> NDArray[Any]:
    """Return the pixels of a rectangle of the sprite's frame, (h, w, 4) of the sprite's type."""
    image, x, y = part_of(sprite, rect)
    whole = np.zeros((rect.height, rect.width, 4), image.dtype)
    whole[y : y + image.shape[0], x : x + image.shape[1]] = image
    return whole


def part_of(sprite: PlacedImage, rect: Rect) -> tuple[NDArray[Any], int, int]:
    """Return the sprite's pixels in a rectangle of its frame, and their x and y there, px."""
    left, top = max(rect.x - sprite.x, 0), max(rect.y - sprite.y, 0)
    right, bottom = rect.x + rect.width - sprite.x, rect.y + rect.height - sprite.y
    image = sprite.image[top : max(bottom, top), left : max(right, left)]
    return image, max(sprite.x - rect.x, 0), max(sprite.y - rect.y, 0)


def _extent(mask: NDArray[np.unsignedinteger]) -> Rect | None:
    rows = np.flatnonzero(np.bitwise_or.reduce(mask, axis=1))
    if not rows.size:
        return None
    columns = np.flatnonzero(np.bitwise_or.reduce(mask[rows[0] : rows[-1] + 1], axis=0))
    x, y = int(columns[0]), int(rows[0])
    return Rect(x, y, int(columns[-1]) + 1 - x, int(rows[-1]) + 1 - y)


def bounding_rect(parts: Sequence[Rect]) -> Rect:
    """Return the smallest rectangle around all ``parts``, of which there must be one."""
    x, y = min(rect.x for rect in parts), min(rect.y for rect in parts)
    right = max(rect.x + rect.width for rect in parts)
    bottom = max(rect.y + rect.height for rect in parts)
    return Rect(x, y, right - x, bottom - y)


def _on_grid(rect: Rect, unit: int) -> Rect:
    """Return the smallest rectangle around ``rect`` whose corners are on multiples of ``unit``."""
    x, y = rect.x // unit * unit, rect.y // unit * unit
    right, bottom = rect.x + rect.width, rect.y + rect.height
    return Rect(x, y, up_to(unit, right) - x, up_to(unit, bottom) - y)


def up_to(unit: int, length: int) -> int:
    """Return the smallest multiple of ``unit`` that is at least ``length``."""
    return -(-length // unit) * unit
