"""Frames at another height, resized in light so that edges neither darken nor fringe."""

from typing import cast

import cv2
import numpy as np

from fire_atlas.core.picture import Picture, brightest
from fire_atlas.core.pixels import Pixels


def width_for(height: int, size: tuple[int, int]) -> int:
    """Return the width, px, that keeps the shape of ``size`` (width, height) at ``height``."""
    return max(1, int(size[0] * height / size[1] + 0.5))


def nearest(picture: Picture, width: int, height: int) -> Picture:
    """Return a picture (height, width, 4) of the pixels nearest to each place: no new colours."""
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_NEAREST_EXACT))


def resize(pixels: Pixels, width: int, height: int) -> Pixels:
    """Return pixels (height, width, 4): area averages when shrinking, bicubic when growing.

    Bicubic overshoots beside edges; the result is held to what premultiplied light can be.
    """
    if pixels.shape[:2] == (height, width):
        return pixels
    if height <= pixels.shape[0] and width <= pixels.shape[1]:
        shrunk = cast(Pixels, cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA))
        # The weights of an average may sum to an ulp more than 1.
        np.minimum(shrunk[..., 3], 1, out=shrunk[..., 3])
        return shrunk
    grown = cast(Pixels, cv2.resize(pixels, (width, height), interpolation=cv2.INTER_CUBIC))
    rgb, alpha = grown[..., :3], np.clip(grown[..., 3], 0, 1)
    np.maximum(rgb, 0, out=rgb)
    if bool((brightest(pixels) <= pixels[..., 3]).all()):
        # Not HDR: nothing shines brighter than it covers, and so it must stay.
        np.minimum(rgb, alpha[..., None], out=rgb)
    grown[..., 3] = alpha
    return grown
