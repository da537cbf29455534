"""Resize frames: in linear light and premultiplied, or by nearest neighbour for pixel art."""

from functools import cache
from math import ceil, floor
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import Picture, brightest, light_of
from fire_atlas.core.pixels import Pixels, as_plane

_BAND = 4
"""Rows of a reduced frame that are made at a time: the light of those that they average still fits
a CPU's cache."""


def width_for(height: int, size: tuple[int, int]) -> int:
    """Return the width, px, at ``height`` with the aspect ratio of ``size`` (width, height)."""
    return max(1, int(size[0] * height / size[1] + 0.5))


def nearest(picture: Picture, width: int, height: int) -> Picture:
    """Resize by nearest neighbour to (height, width, channels), which makes no new colours."""
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_NEAREST_EXACT))


def resize(pixels: Pixels, width: int, height: int) -> Pixels:
    """Resize to (height, width, 4): by area averages when shrinking, bicubic when growing.

    Bicubic interpolation overshoots at edges; the result is clipped to valid premultiplied light.
    """
    if pixels.shape[:2] == (height, width):
        return pixels
    if height <= pixels.shape[0] and width <= pixels.shape[1]:
        return _area_average(pixels, width, height)
    grown = cast(Pixels, cv2.resize(pixels, (width, height), interpolation=cv2.INTER_CUBIC))
    rgb, alpha = grown[..., :3], np.clip(grown[..., 3], 0, 1)
    np.maximum(rgb, 0, out=rgb)
    if bool((brightest(pixels) <= pixels[..., 3]).all()):
        # Not HDR: no light exceeded its coverage before, so none may afterwards.
        np.minimum(rgb, alpha[..., None], out=rgb)
    grown[..., 3] = alpha
    return grown


def reduce(picture: Picture, width: int, height: int) -> Picture:
    """Return a smaller copy of a large picture as light, (height, width, 3 or 4) float32.

    It is what ``resize`` makes of the light of the whole picture, but for rounding. That light, 16
    bytes a pixel, is never in memory: a few rows at a time become light and are averaged.
    """
    weights, step = _row_weights(len(picture), height), len(picture) / height
    rows = np.empty((height, picture.shape[1], picture.shape[2]), np.float32)
    for top in range(0, height, _BAND):
        bottom = min(top + _BAND, height)
        part = slice(floor(top * step), min(len(picture), ceil(bottom * step)))
        light = light_of(picture[part])
        means = weights[top:bottom, part] @ light.reshape(len(light), -1)
        rows[top:bottom] = means.reshape(bottom - top, *light.shape[1:])
    return _area_average(rows, width, height)


@cache
def _row_weights(count: int, means: int) -> NDArray[np.float32]:
    """Return the weight of each of ``count`` rows in each of ``means`` area averages.

    Its shape is (means, count).
    """
    edges, rows = np.linspace(0, count, means + 1), np.arange(count)
    shared = np.minimum(edges[1:, None], rows + 1) - np.maximum(edges[:-1, None], rows)
    return as_plane(np.maximum(shared, 0) * (means / count))


def _area_average(light: Pixels, width: int, height: int) -> Pixels:
    shrunk = cast(Pixels, cv2.resize(light, (width, height), interpolation=cv2.INTER_AREA))
    if shrunk.shape[2] == 4:
        # By rounding, the weights of an average may sum to slightly more than 1.
        np.minimum(shrunk[..., 3], 1, out=shrunk[..., 3])
    return shrunk
