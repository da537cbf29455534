"""Frames in another size, and how far one frame is from another where it is shown in its place."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_sprite
from fire_atlas.atlas.gpu import is_srgb, light_of
from fire_atlas.atlas.sheet import Sprite
from fire_atlas.core.pixels import Bytes, hex_to_linear
from fire_atlas.core.workers import Workers
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.animation.render import RenderedFrame
from fire_atlas.recipe.output import Atlas

DAY = "#8fb8de"
"""The bright background that frames are compared over, beside black: a clear sky."""

_CHANNELS = 4
"""Numbers of a pixel by which pictures are compared; see ``_coordinates``."""

_STRIP_BYTES = 16 << 20
"""Most memory that the same rows of all frames take while they are compared."""

_ROUNDING = 1e-12
"""Squared differences below this share of the light are rounding errors of their sums."""


def at_heights(
    animation: FinishedAnimation, heights: Sequence[int], atlas: Atlas, workers: Workers
) -> list[FinishedAnimation]:
    """Return an animation, whose frames are H px high, once for each of ``heights``, px.

    Each pixel is the mean of the linear premultiplied light that it covers. Frames that have a
    height already stay as they are.
    """
    resized = workers.map(lambda frame: _resized(frame, heights, atlas), animation.frames)
    before, made = animation.frames[0], list[FinishedAnimation]()
    for frames in zip(*resized, strict=True):
        foot = animation.foot and (
            animation.foot[0] * frames[0].width / before.width,
            animation.foot[1] * frames[0].height / before.height,
        )
        made.append(replace(animation, frames=frames, foot=foot))
    return made


def _resized(frame: RenderedFrame, heights: Sequence[int], atlas: Atlas) -> list[RenderedFrame]:
    if list(heights) == [frame.height]:
        return [frame]
    (sprite,) = frame.sprites
    light = light_of(sprite.image, atlas)
    rows, columns, channels = light.shape
    whole = np.zeros((frame.height, frame.width, channels), np.float32)
    whole[sprite.y : sprite.y + rows, sprite.x : sprite.x + columns] = light

    def at(height: int) -> RenderedFrame:
        if height == frame.height:
            return frame
        width = max(round(frame.width * height / frame.height), 1)
        # OpenCV resizes four channels at most.
        pixels, *cover = (
            np.asarray(cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA), np.float32)
            for part in (whole[..., :4], *np.moveaxis(whole[..., 4:], 2, 0))
        )
        made = encode_sprite(
            pixels, atlas.alpha, atlas.blend_space, atlas.trim_threshold,
            cover=cover[0] if cover else None,
        )  # fmt: skip
        return replace(frame, sprites=(made,), width=width, height=height)

    return [at(height) for height in heights]


def as_textures(
    heights: Sequence[Sequence[Sprite]], blocks: Sequence[str], atlas: Atlas, workers: Workers
) -> Iterator[Sequence[Sequence[Sprite]]]:
    """Yield frames as a GPU shows them, once for each of ``blocks`` that they are compressed to, or
    as they are if there are none.

    Args:
        heights: The frames in each of several heights.
        blocks: ``bc7``, ``astc-6x6``, ... They are encoded as drafts, each frame by itself.
        atlas: How their pixels are stored.
        workers: Encode them.
    """
    if not blocks:
        yield heights
        return
    from fire_atlas.formats.textures.blocks import FORMATS, decode_whole
    from fire_atlas.formats.textures.encode import encode_images

    images = [sprite.image for sprites in heights for sprite in sprites]
    srgb = is_srgb(atlas)
    encoded = encode_images(
        images, [FORMATS[name] for name in blocks], srgb, workers, quality="draft",
        content="straight" if atlas.alpha == "straight" else "premultiplied",
    )  # fmt: skip
    for name, data in zip(blocks, encoded, strict=True):
        side = FORMATS[name].side

        def decoded(of: tuple[Bytes, bytes], name: str = name, side: int = side) -> Bytes:
            image, blocks_of_image = of
            height, width = image.shape[:2]
            whole = -(-width // side) * side, -(-height // side) * side
            pixels = decode_whole(blocks_of_image, *whole, FORMATS[name], srgb)
            return pixels[:height, :width]

        shown = workers.map(decoded, zip(images, data, strict=True))
        yield [[replace(sprite, image=next(shown)) for sprite in sprites] for sprites in heights]


def squared_errors(
    whole: Sequence[Sprite], variants: Sequence[Sequence[Sprite]], atlas: Atlas, workers: Workers
) -> NDArray[np.float64]:
    """Return how far each frame j of each variant is from each frame i of ``whole``: (variant, i,
    j).

    It is the sum, over all pixels and colours, of the squared differences of linear light, over
    black and over ``DAY``. Frames of another size are enlarged as a GPU does, bilinearly.
    """
    width, height, count = whole[0].frame_width, whole[0].frame_height, len(whole)
    each = width * _CHANNELS * np.dtype(np.float64).itemsize * 2 * count
    rows = max(_STRIP_BYTES // each, 1)

    def of_strip(top: int) -> NDArray[np.float64]:
        bottom = min(top + rows, height)

        def values(sprites: Sequence[Sprite]) -> NDArray[np.float64]:
            strips = (_enlarged(sprite, atlas, top, bottom, width, height) for sprite in sprites)
            return np.stack([strip.ravel() for strip in strips])

        def squares(of: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(np.einsum("ij,ij->i", of, of))

        wanted, sums = values(whole), np.empty((2, len(variants), count, count))
        for number, sprites in enumerate(variants):
            shown = values(sprites)
            sums[0, number] = np.add.outer(squares(wanted), squares(shown))
            sums[1, number] = wanted @ shown.T
        return sums

    parts = workers.map(of_strip, range(0, height, rows))
    squares, products = sum(parts, np.zeros((2, len(variants), count, count)))
    errors = squares - 2 * products
    return np.asarray(np.where(errors > _ROUNDING * squares, errors, 0))


def _enlarged(
    sprite: Sprite, atlas: Atlas, top: int, bottom: int, width: int, height: int
) -> NDArray[np.float64]:
    """Return rows ``top`` to ``bottom`` of a frame as if it were ``width`` × ``height`` px, in the
    coordinates of ``_coordinates``."""
    if (sprite.frame_width, sprite.frame_height) == (width, height):
        return _coordinates(sprite, atlas, top, bottom)
    at = (np.arange(top, bottom) + 0.5) * (sprite.frame_height / height) - 0.5
    above = np.floor(at).astype(np.int64)
    weight = (at - above)[:, None, None]
    above, below = (np.clip(row, 0, sprite.frame_height - 1) for row in (above, above + 1))
    first = int(above[0])
    rows = _coordinates(sprite, atlas, first, int(below[-1]) + 1)
    band = rows[above - first] * (1 - weight) + rows[below - first] * weight
    resized = cv2.resize(band, (width, bottom - top), interpolation=cv2.INTER_LINEAR)
    return np.asarray(resized, np.float64)


def _coordinates(sprite: Sprite, atlas: Atlas, top: int, bottom: int) -> NDArray[np.float64]:
    """Return rows of a frame (rows, W, 4) in coordinates whose squared distance is that of the
    pictures over black and over the day.

    With light c, coverage a and background d: c² + (c - d a)² = 2 (c - d a / 2)² + (d a)² / 2, and
    the last term is summed over the colours.
    """
    found = np.zeros((bottom - top, sprite.frame_width, _CHANNELS))
    first, last = max(top - sprite.y, 0), min(bottom - sprite.y, sprite.image.shape[0])
    if first >= last:
        return found
    light = light_of(np.ascontiguousarray(sprite.image[first:last]), atlas).astype(np.float64)
    hidden = np.zeros_like(light[..., 3]) if atlas.alpha == "additive" else light[..., -1]
    day = hex_to_linear([DAY])[0].astype(np.float64)
    start = sprite.y + first - top
    part = found[start : start + last - first, sprite.x : sprite.x + light.shape[1]]
    part[..., :3] = np.sqrt(2) * (light[..., :3] - hidden[..., None] * (day / 2))
    part[..., 3] = hidden * np.sqrt(np.sum(day**2) / 2)
    return found
