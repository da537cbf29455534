"""Encode pixels for pages: linear premultiplied light becomes the bytes a renderer blends.

A renderer shows ``light + (1 - alpha) * background``. What ``light`` is depends on where it blends:

=============  =================  ===================
stored         ``srgb`` blending  ``linear`` blending
=============  =================  ===================
straight       sRGB(c), alpha     sRGB(c), alpha
premultiplied  sRGB(c) · alpha    sRGB(c · alpha)
additive       as premultiplied, with alpha 0
=============  =================  ===================

c is the colour without its coverage, clipped at 1: a page cannot be brighter than white, so
composition raises coverage wherever it wants more light.
"""

from typing import Literal, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import Sprite
from fire_atlas.atlas.trim import trimmed, up_to
from fire_atlas.core.picture import Picture, as_light, where_covered
from fire_atlas.core.pixels import Bytes, Pixels, Plane, encode_bytes, encode_unit
from fire_atlas.recipe.output import Atlas

Alpha = Literal["straight", "premultiplied", "additive"]
BlendSpace = Literal["srgb", "linear"]

_STRIP = 64
"""Rows encoded at a time, so that temporaries stay in the processor's cache."""

_INVISIBLE = 0.5 / 255 / 12.92
"""Coverage below this is byte 0 in every encoding: half a step on the steepest part of sRGB."""

_LEAST = np.float32(1e-12)
"""Coverage that what is divided by it has at least; light that is 0 stays 0."""

_DIM = 16
"""Coverage below this many of its 255 steps is too coarse for blending in linear light."""


def encode_frame(pixels: Pixels, alpha: Alpha, blend_space: BlendSpace) -> Bytes:
    """Return pixels (H, W, 4) as the RGBA, same shape, uint8, that the renderer blends to them.

    By the renderer's own formula that is the picture, over any background, to within 1/255 for
    premultiplied and additive pages and 2/255 for straight ones.
    """
    image = np.empty(pixels.shape, np.uint8)
    for top in range(0, pixels.shape[0], _STRIP):
        strip = slice(top, top + _STRIP)
        image[strip] = _encode_strip(pixels[strip], alpha, blend_space)
    return image


def is_page_ready(picture: Picture, settings: Atlas) -> bool:
    """Whether the only pages there are hold a picture as it is: as bytes of straight colours."""
    return picture.dtype == np.uint8 and settings.alpha == "straight" and settings.scales == (1.0,)


def encode_sprites(picture: Picture, settings: Atlas) -> tuple[Sprite, ...]:
    """Return a frame (H, W, 4) as it goes onto the pages of each scale, the largest first."""
    if is_page_ready(picture, settings):
        return (_sprite_of_bytes(picture, settings.trim_threshold),)
    pixels = as_light(picture)
    return tuple(
        encode_sprite(
            pixels if scale == 1 else shrink(pixels, round(1 / scale)),
            settings.alpha,
            settings.blend_space,
            settings.trim_threshold,
        )
        for scale in settings.scales
    )


def shrink(pixels: Pixels, factor: int) -> Pixels:
    """Return pixels (H, W, 4) in 1 / ``factor`` of the size, rounded up.

    Each pixel is the mean of a block of the premultiplied light; beyond the frame there is none.
    """
    height, width = pixels.shape[:2]
    whole = np.zeros((up_to(factor, height), up_to(factor, width), 4), np.float32)
    whole[:height, :width] = pixels
    size = whole.shape[1] // factor, whole.shape[0] // factor
    return cast(Pixels, cv2.resize(whole, size, interpolation=cv2.INTER_AREA))


def _sprite_of_bytes(image: Bytes, threshold: int) -> Sprite:
    """Return an image of straight colours trimmed; what coverage 0 hides is black, as it is when
    it is encoded."""
    frame_size, part = (image.shape[1], image.shape[0]), where_covered(image)
    lit = image[part]
    if not lit.size:
        return trimmed(np.zeros((1, 1, 4), np.uint8), frame_size=frame_size)
    shown = cv2.bitwise_and(lit, lit, mask=cv2.extractChannel(lit, 3))
    return trimmed(np.asarray(shown, np.uint8), part[1].start, part[0].start, frame_size, threshold)


def encode_sprite(
    pixels: Pixels, alpha: Alpha, blend_space: BlendSpace, threshold: int = 0
) -> Sprite:
    """Return pixels (H, W, 4) encoded and trimmed; dark borders cost next to nothing."""
    frame_size = pixels.shape[1], pixels.shape[0]
    visible = pixels[..., 3] > _INVISIBLE
    rows, columns = np.flatnonzero(visible.any(axis=1)), np.flatnonzero(visible.any(axis=0))
    if not rows.size:
        return trimmed(np.zeros((1, 1, 4), np.uint8), frame_size=frame_size)
    top, left = int(rows[0]), int(columns[0])
    lit = pixels[top : rows[-1] + 1, left : columns[-1] + 1]
    image = encode_frame(lit, alpha, blend_space)
    return trimmed(image, left, top, frame_size, threshold)


def _encode_strip(pixels: Pixels, alpha: Alpha, blend_space: BlendSpace) -> Bytes:
    coverage = np.clip(pixels[..., 3], 0.0, 1.0)
    if alpha == "straight":
        return _straight(pixels, coverage, blend_space)
    image = _added(_held(pixels, coverage), coverage, blend_space)
    image[..., 3] = 0 if alpha == "additive" else _bytes(coverage)
    return image


def _straight(pixels: Pixels, coverage: Plane, blend_space: BlendSpace) -> Bytes:
    """Return sRGB(c) and coverage; what coverage 0 hides is black, so that it can be trimmed.

    Blending in linear light shows one step of dim coverage as up to 13 steps of the screen's sRGB.
    Dim coverage is therefore rounded up and the colour, whose sRGB steps are fine enough in the
    dark, is dimmed to make up for it.
    """
    shown = _rounded_up_where_dim(coverage) if blend_space == "linear" else coverage
    alpha = _bytes(shown)
    shown[alpha == 0] = 0
    image = encode_bytes(_colour(_held(pixels, np.minimum(coverage, shown)), shown))
    image[..., 3] = alpha
    return image


def _rounded_up_where_dim(coverage: Plane) -> Plane:
    steps = coverage * np.float32(255)
    np.ceil(steps - np.float32(1e-3), out=steps, where=steps < _DIM)
    return steps / np.float32(255)


def _added(light: Pixels, coverage: Plane, blend_space: BlendSpace) -> Bytes:
    """Return what the renderer adds to the background, RGB as bytes; the fourth channel is free."""
    if blend_space == "linear":
        return encode_bytes(light)
    srgb = encode_unit(_colour(light, coverage))
    return cast(Bytes, cv2.multiply(srgb, _spread(coverage), scale=255, dtype=cv2.CV_8U))


def _colour(light: Pixels, coverage: Plane) -> NDArray[np.float32]:
    """Return linear colour (H, W, 4) without its coverage; black where there is none.

    ``light`` is no brighter than its coverage. The fourth channel is free.
    """
    return cast(NDArray[np.float32], cv2.divide(light, np.maximum(_spread(coverage), _LEAST)))


def _held(pixels: Pixels, coverage: Plane) -> Pixels:
    """Return pixels no brighter than their coverage."""
    return cast(Pixels, cv2.min(pixels, _spread(coverage)))


def _spread(plane: Plane) -> NDArray[np.float32]:
    return cast(NDArray[np.float32], cv2.merge((plane, plane, plane, plane)))


def _bytes(plane: Plane) -> Bytes:
    return cast(Bytes, cv2.convertScaleAbs(plane, alpha=255))
