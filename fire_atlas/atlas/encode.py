"""Encode pixels for pages: from linear premultiplied light to the bytes that a renderer blends.

A renderer shows ``light + (1 - alpha) * background``. It computes ``light`` from the stored bytes,
which are, by the blend space:

=============  =================  ===================
stored         ``srgb`` blending  ``linear`` blending
=============  =================  ===================
straight       sRGB(c), alpha     sRGB(c), alpha
premultiplied  sRGB(c) · alpha    sRGB(c · alpha)
additive       as premultiplied, with alpha 0
=============  =================  ===================

On premultiplied pages the stored alpha may be less than the coverage: how much of the background is
to be hidden is stated apart (``cover``).

c is the colour divided by its coverage, clipped at 1. A page cannot be brighter than white, so
composition raises coverage where it needs more light.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal, TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.compressed import CompressedImage
from fire_atlas.atlas.deep import deepened
from fire_atlas.atlas.sheet import Sprite
from fire_atlas.atlas.trim import trimmed, up_to
from fire_atlas.core.picture import Picture, as_light, brightest, where_covered
from fire_atlas.core.pixels import (
    Bytes,
    Pixels,
    Plane,
    as_plane,
    decode_bytes,
    encode_bytes,
    encode_unit,
    srgb_of,
    srgb_to_linear,
)
from fire_atlas.recipe.output import Atlas

_MOST_LIGHT = np.float32(np.finfo(np.float16).max)
"""The most light that a half float holds."""

_Values = TypeVar("_Values", bound=NDArray[np.float32])

Alpha = Literal["straight", "premultiplied", "additive"]
BlendSpace = Literal["srgb", "linear"]

_STRIP = 64
"""Number of rows encoded at a time, so that temporaries stay in the processor's cache."""

_INVISIBLE = 0.5 / 255 / 12.92
"""Coverage below this is byte 0 in every encoding: half a step on the steepest part of sRGB."""

_MIN_DIVISOR = np.float32(1e-12)
"""Minimum coverage that light is divided by."""

_DIM = 16
"""Below this, of 255, the steps of coverage are too coarse for blending in linear light."""


def encode_frame(
    pixels: Pixels, alpha: Alpha, blend_space: BlendSpace, cover: Plane | None = None
) -> Bytes:
    """Encode pixels (H, W, 4) as the RGBA bytes, same shape, that a renderer blends.

    By the renderer's formula they give the picture, over any background, to within 1/255 for
    premultiplied and additive pages and 2/255 for straight ones.

    Args:
        pixels: The picture.
        alpha, blend_space: How the renderer blends.
        cover: (H, W) 0..1, what premultiplied pages hide of what is behind the picture; None: as
            much as its coverage says.
    """
    image = np.empty(pixels.shape, np.uint8)
    for top in range(0, pixels.shape[0], _STRIP):
        strip = slice(top, top + _STRIP)
        image[strip] = _encode_strip(pixels[strip], alpha, blend_space)
    if cover is not None and alpha == "premultiplied":
        image[..., 3] = _bytes(as_plane(np.clip(cover, 0, 1)))
    return image


def light_over_black(image: Bytes, alpha: str, blend_space: str) -> NDArray[np.float32]:
    """Return the light (H, W, 3) that a renderer shows of encoded RGBA bytes over black."""
    rgb = image[..., :3]
    if alpha != "straight":
        return decode_bytes(rgb)
    cover = image[..., 3:] * np.float32(1 / 255)
    if blend_space == "linear":
        return decode_bytes(rgb) * cover
    return srgb_to_linear(rgb * np.float32(1 / 255) * cover)


def as_straight(image: Bytes, alpha: str, blend_space: str) -> Bytes:
    """Return encoded RGBA bytes (H, W, 4) with straight alpha for a player that blends in sRGB.

    Over black it shows what a renderer shows of ``image``. Where that is brighter than the coverage
    allows, as light that is only added is, coverage is raised to it.
    """
    if (alpha, blend_space) == ("straight", "srgb"):
        return image
    shown = encode_unit(light_over_black(image, alpha, blend_space))
    cover = np.maximum(image[..., 3] * np.float32(1 / 255), brightest(shown))
    cover = np.ceil(cover * np.float32(255) - np.float32(1e-3)) / np.float32(255)
    straight = np.zeros(image.shape, np.uint8)
    colour = shown / np.maximum(cover, _MIN_DIVISOR)[..., None]
    straight[..., :3] = np.rint(np.clip(colour, 0, 1) * 255)
    straight[..., 3] = np.rint(cover * 255)
    return straight


def over_smoke(page: Bytes, smoke: Bytes, alpha: str, blend_space: str) -> Bytes:
    """Return encoded RGBA bytes (H, W, 4) of fire over its smoke, encoded as the page is; of pages
    that are added, with the smoke's coverage as alpha."""
    fire, below = (_blended(image, alpha, blend_space) for image in (page, smoke))
    left = 1 - fire[..., 3:]
    both = np.minimum(fire + left * below, 1)
    if alpha == "straight":
        both[..., :3] /= np.maximum(both[..., 3:], _MIN_DIVISOR)
    if blend_space == "linear":
        both[..., :3] = encode_unit(np.asarray(both[..., :3], np.float32))
    return np.asarray(np.rint(both * 255), np.uint8)


def _blended(image: Bytes, alpha: str, blend_space: str) -> NDArray[np.float32]:
    """Return what a client adds of encoded bytes, in its blend space, and their coverage, 0..1."""
    values = image * np.float32(1 / 255)
    if blend_space == "linear":
        values[..., :3] = decode_bytes(np.ascontiguousarray(image[..., :3]))
    if alpha == "straight":
        values[..., :3] *= values[..., 3:]
    return values


def is_page_ready(picture: Picture, settings: Atlas) -> bool:
    """Whether the pages hold the picture's bytes unchanged: straight alpha, full size only."""
    is_plain = settings.alpha == "straight" and settings.scales == (1.0,) and settings.bits == 8
    return picture.dtype == np.uint8 and is_plain


def encode_sprites(
    picture: Picture, settings: Atlas, cover: Plane | None = None
) -> tuple[Sprite, ...]:
    """Encode and trim a frame (H, W, 4) for the pages of each scale, the largest first.

    ``cover`` is as for ``encode_frame``, in full size.
    """
    if is_page_ready(picture, settings):
        return (_sprite_of_bytes(picture, settings.trim_threshold),)
    variants = scaled(as_light(picture), settings.scales)
    covers: list[Any] = [None] * len(variants) if cover is None else scaled(cover, settings.scales)
    return tuple(
        encode_sprite(
            variant,
            settings.alpha,
            settings.blend_space,
            settings.trim_threshold,
            bits=settings.bits,
            cover=covered,
        )
        for variant, covered in zip(variants, covers, strict=True)
    )


def scaled(pixels: _Values, scales: Sequence[float]) -> list[_Values]:
    """Return a frame (H, W, 4), or a plane (H, W), in each of ``scales``."""
    return [pixels if scale == 1 else shrink(pixels, round(1 / scale)) for scale in scales]


def light_images(pixels: Pixels, scales: Sequence[float]) -> tuple[CompressedImage, ...]:
    """Return the light of a frame (H, W, 4) as trimmed half floats for the pages of each scale."""
    return tuple(_light_image(variant) for variant in scaled(pixels, scales))


def _light_image(pixels: Pixels) -> CompressedImage:
    half = np.minimum(pixels, _MOST_LIGHT).astype(np.float16)
    rows, columns = _extent((half != 0).any(axis=2))
    return CompressedImage.of(half[rows, columns], columns.start, rows.start)


def _extent(seen: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Return the rows and columns of the smallest box around what is seen in (H, W)."""
    across, down = np.flatnonzero(seen.any(axis=0)), np.flatnonzero(seen.any(axis=1))
    if not down.size:
        return slice(0, 0), slice(0, 0)
    return slice(int(down[0]), int(down[-1]) + 1), slice(int(across[0]), int(across[-1]) + 1)


def shrink(pixels: _Values, factor: int) -> _Values:
    """Return pixels (H, W, 4), or a plane (H, W), at 1 / ``factor`` of the size, rounded up.

    Each pixel is the mean of a block of premultiplied light, which is 0 beyond the frame.
    """
    height, width = pixels.shape[:2]
    whole = np.zeros((up_to(factor, height), up_to(factor, width), *pixels.shape[2:]), np.float32)
    whole[:height, :width] = pixels
    size = whole.shape[1] // factor, whole.shape[0] // factor
    return cast(_Values, cv2.resize(whole, size, interpolation=cv2.INTER_AREA))


def _sprite_of_bytes(image: Bytes, threshold: int) -> Sprite:
    """Trim an image with straight alpha; pixels of coverage 0 become black, as in all encoded
    frames."""
    frame_size, part = (image.shape[1], image.shape[0]), where_covered(image)
    lit = image[part]
    if not lit.size:
        return trimmed(np.zeros((1, 1, 4), np.uint8), frame_size=frame_size)
    shown = cv2.bitwise_and(lit, lit, mask=cv2.extractChannel(lit, 3))
    return trimmed(np.asarray(shown, np.uint8), part[1].start, part[0].start, frame_size, threshold)


def encode_sprite(
    pixels: Pixels,
    alpha: Alpha,
    blend_space: BlendSpace,
    threshold: int = 0,
    *,
    bits: int = 8,
    cover: Plane | None = None,
) -> Sprite:
    """Encode and trim pixels (H, W, 4); empty borders are not encoded, to save time.

    The sprite of 16 ``bits`` has 8 as well, by which it is placed. ``cover`` is as for
    ``encode_frame``.
    """
    frame_size = pixels.shape[1], pixels.shape[0]
    rows, columns = _extent(pixels[..., 3] > _INVISIBLE)
    if rows.stop == 0:
        return trimmed(np.zeros((1, 1, 4), np.uint8), frame_size=frame_size)
    lit, covered = pixels[rows, columns], None if cover is None else cover[rows, columns]
    image = encode_frame(lit, alpha, blend_space, covered)
    sprite = trimmed(
        image, columns.start, rows.start, frame_size, threshold, is_straight=alpha == "straight"
    )
    return _in_16_bits(sprite, pixels, alpha, blend_space, cover) if bits == 16 else sprite


def _in_16_bits(
    sprite: Sprite, pixels: Pixels, alpha: Alpha, blend_space: BlendSpace, cover: Plane | None
) -> Sprite:
    """Return a sprite with its 16 bits, of the frame's pixels (H, W, 4) and cover (H, W)."""
    height, width = sprite.image.shape[:2]
    part = slice(sprite.y, sprite.y + height), slice(sprite.x, sprite.x + width)
    lit, words = pixels[part], np.empty(sprite.image.shape, np.uint16)
    for top in range(0, height, _STRIP):
        strip = slice(top, top + _STRIP)
        exact = _exact(lit[strip], alpha, blend_space)
        if cover is not None and alpha == "premultiplied":
            exact[..., 3] = np.clip(cover[part][strip], 0, 1)
        words[strip] = deepened(sprite.image[strip], exact)
    return replace(sprite, deep=CompressedImage.of(words, sprite.x, sprite.y))


def _exact(pixels: Pixels, alpha: Alpha, blend_space: BlendSpace) -> NDArray[np.float64]:
    """Return what is stored of pixels (H, W, 4) before it is rounded, 0..1."""
    coverage = np.clip(pixels[..., 3], 0.0, 1.0)
    stored = np.empty(pixels.shape, np.float64)
    if alpha == "straight":
        shown = _rounded_up_where_dim(coverage) if blend_space == "linear" else coverage
        light = _limited(pixels, np.minimum(coverage, shown))
        stored[:] = srgb_of(np.minimum(_colour(light, shown), 1))
        stored[..., 3] = shown
        return stored
    light = _limited(pixels, coverage)
    if blend_space == "linear":
        stored[:] = srgb_of(light)
    else:
        stored[:] = srgb_of(np.minimum(_colour(light, coverage), 1)) * coverage[..., None]
    stored[..., 3] = 0 if alpha == "additive" else coverage
    return stored


def _encode_strip(pixels: Pixels, alpha: Alpha, blend_space: BlendSpace) -> Bytes:
    coverage = np.clip(pixels[..., 3], 0.0, 1.0)
    if alpha == "straight":
        return _straight(pixels, coverage, blend_space)
    image = _added(_limited(pixels, coverage), coverage, blend_space)
    image[..., 3] = 0 if alpha == "additive" else _bytes(coverage)
    return image


def _straight(pixels: Pixels, coverage: Plane, blend_space: BlendSpace) -> Bytes:
    """Return sRGB(c) and coverage; pixels of coverage 0 are black, so that they can be trimmed.

    Blending in linear light shows one step of dim coverage as up to 13 steps of the screen's sRGB.
    Dim coverage is therefore rounded up, and the colour, whose sRGB steps are fine enough in the
    dark, is dimmed to compensate.
    """
    shown = _rounded_up_where_dim(coverage) if blend_space == "linear" else coverage
    alpha = _bytes(shown)
    shown[alpha == 0] = 0
    image = encode_bytes(_colour(_limited(pixels, np.minimum(coverage, shown)), shown))
    image[..., 3] = alpha
    return image


def _rounded_up_where_dim(coverage: Plane) -> Plane:
    steps = coverage * np.float32(255)
    np.ceil(steps - np.float32(1e-3), out=steps, where=steps < _DIM)
    return steps / np.float32(255)


def _added(light: Pixels, coverage: Plane, blend_space: BlendSpace) -> Bytes:
    """Return the light that the renderer adds, RGB as bytes; the fourth channel is arbitrary."""
    if blend_space == "linear":
        return encode_bytes(light)
    srgb = encode_unit(_colour(light, coverage))
    return cast(Bytes, cv2.multiply(srgb, _in_four_channels(coverage), scale=255, dtype=cv2.CV_8U))


def _colour(light: Pixels, coverage: Plane) -> NDArray[np.float32]:
    """Return linear colour (H, W, 4): light divided by its coverage; black where there is none.

    ``light`` is no brighter than its coverage. The fourth channel of the result is arbitrary.
    """
    divisor = np.clip(_in_four_channels(coverage), _MIN_DIVISOR, 1)
    return cast(NDArray[np.float32], cv2.divide(light, divisor))


def _limited(pixels: Pixels, coverage: Plane) -> Pixels:
    """Limit pixels to be no brighter than their coverage."""
    return cast(Pixels, cv2.min(pixels, _in_four_channels(coverage)))


def _in_four_channels(plane: Plane) -> NDArray[np.float32]:
    return cast(NDArray[np.float32], cv2.merge((plane, plane, plane, plane)))


def _bytes(plane: Plane) -> Bytes:
    return cast(Bytes, cv2.convertScaleAbs(plane, alpha=255))
