"""Compressed textures of a sheet: which there are, and the mip levels in them."""

from collections.abc import Iterator
from dataclasses import replace
from typing import TypeAlias, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.drawing import bleed_colour
from fire_atlas.atlas.encode import encode_frame
from fire_atlas.atlas.page_rules import LEVELS_APART
from fire_atlas.atlas.sheet import AtlasSheet, GpuTexture
from fire_atlas.core.pixels import Bytes, decode_bytes, decode_unit
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.gpu import blocks_of, formats_for, texture_file
from fire_atlas.recipe.output import Atlas

_BAND_ROWS = 128
"""Rows of the page that are decoded at a time, which bounds the memory. Even."""

_Values: TypeAlias = NDArray[np.float32]


def with_textures(sheet: AtlasSheet, settings: Atlas) -> AtlasSheet:
    """Return ``sheet`` with the names of its compressed textures, each page's after another's."""
    textures = [
        GpuTexture(
            texture_file(image, format_),
            image,
            blocks_of(format_),
            levels_of(sheet, page, settings),
        )
        for page in range(len(sheet.pages))
        for image in sheet.images(page)
        for format_ in formats_for(settings.gpu, sheet.channels_of(image))
    ]
    return replace(sheet, gpu=tuple(textures))


def levels_of(sheet: AtlasSheet, page: int, settings: Atlas) -> int:
    """Return the number of mip levels of a page's textures."""
    longest = max(sheet.pages[page].width, sheet.pages[page].height)
    levels = LEVELS_APART if settings.mips == "auto" else settings.mips
    return min(levels, longest.bit_length())


def mip_levels(
    image: Bytes, levels: int, settings: Atlas, workers: Workers, *, is_data: bool = False
) -> Iterator[Bytes]:
    """Yield an image (H, W, 4) uint8 and its further mip levels, each half as large, rounded down.

    Each pixel is the mean of a block of 2 × 2 of the level before: of linear premultiplied light,
    or, of data, of the values themselves.
    """
    yield image
    values: _Values | None = None
    for level in range(1, levels):
        values = _second(image, settings, workers, is_data) if values is None else _half(values)
        yield workers.start(lambda: _encoded(values, level, settings, is_data)).result()  # noqa: B023


def _second(image: Bytes, settings: Atlas, workers: Workers, is_data: bool) -> _Values:
    """Return the level after the image, decoded and reduced band by band."""
    rows = _BAND_ROWS if len(image) % 2 == 0 else len(image)

    def reduced(top: int) -> _Values:
        band = image[top : top + rows]
        return _half(band.astype(np.float32) if is_data else light_of(band, settings))

    return np.concatenate(list(workers.map(reduced, range(0, len(image), rows))))


def _half(values: _Values) -> _Values:
    """Return values (H, W, 4) at half the size, rounded down but for a single row or column."""
    height, width = values.shape[:2]
    size = max(width // 2, 1), max(height // 2, 1)
    # OpenCV resizes four channels at most.
    parts = [
        cv2.resize(part, size, interpolation=cv2.INTER_AREA).reshape(size[1], size[0], -1)
        for part in (values[..., :4], values[..., 4:])
        if part.shape[2]
    ]
    return cast(_Values, np.concatenate(parts, axis=2) if len(parts) > 1 else parts[0])


def is_srgb(settings: Atlas) -> bool:
    """Return whether GPUs decode colours of pages from sRGB as they sample them: clients that blend
    in sRGB sample them as they are stored."""
    return settings.blend_space == "linear"


def light_of(image: Bytes, settings: Atlas) -> NDArray[np.float32]:
    """Return linear premultiplied light (H, W, 4) of the bytes of a page; see ``encode``.

    Of an additive page, which stores no coverage, that is 1: what is added stays the same. Where
    thin light covers less than it shines, its coverage is what it needs, and a fifth channel has
    what it covers.
    """
    unit, light = image.astype(np.float32) / np.float32(255), decode_bytes(image[..., :3])
    coverage = stored = unit[..., 3:]
    if settings.alpha == "additive":
        coverage = np.ones_like(stored)
    elif settings.thins:
        shown = light if settings.blend_space == "linear" else unit[..., :3]
        coverage = np.maximum(stored, shown.max(axis=2, keepdims=True))
    if settings.alpha == "straight":
        light = light * coverage
    elif settings.blend_space == "srgb":
        none = np.zeros_like(light)
        light = decode_unit(np.divide(unit[..., :3], coverage, out=none, where=coverage > 0))
        light = light * coverage
    return np.concatenate([light, coverage, *([stored] if settings.thins else [])], axis=2)


def _encoded(values: _Values, level: int, settings: Atlas, is_data: bool) -> Bytes:
    """Return a level as bytes; straight colours bleed as far as on the page."""
    if is_data:
        return np.asarray(np.rint(values), np.uint8)
    light, cover = np.ascontiguousarray(values[..., :4]), values[..., 4] if settings.thins else None
    image = encode_frame(light, settings.alpha, settings.blend_space, cover)
    return bleed_colour(image, -(-settings.bleed >> level)) if settings.bleed else image
