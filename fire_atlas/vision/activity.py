"""Find where a clip moves, as opposed to places that only brighten and darken with its light."""

from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane, as_plane

_SIDE = 320
"""Longest side, px, of the small copy on which the mask is dilated and its holes are filled."""

_BRIGHT = 12.0
"""The flicker is measured on pixels brighter than this, 0..255."""


def activity(planes: list[Plane]) -> Plane:
    """Return a soft mask of the moving parts of a few frames and their surroundings, 0..1 (H, W).

    Things lit by the fire flicker with it, all by the same factor, which is divided out first.
    Moving flame changes a pixel by most of its brightness. The core of a steady flame does not
    change, but moving flame encloses it, so holes are filled. For a single frame the mask is 1.

    Args:
        planes: Brightness of the frames, 0..255.
    """
    if len(planes) == 1:
        return np.ones_like(planes[0])
    peak: Plane = reduce(np.maximum, planes)
    change = _change_beside_flicker(planes)
    share = np.clip((change / (peak + 10.0) - 0.25) / 0.25, 0.0, 1.0)
    brightest = np.clip(peak / max(float(np.quantile(peak, 0.995)), 1.0) * 4.0 - 2.8, 0.0, 1.0)
    moves = np.clip((change - 8.0) / 24.0, 0.0, 1.0) * np.maximum(share, brightest)
    return _widened_and_filled(as_plane(moves))


def mean_of(planes: list[Plane]) -> Plane:
    """Return the mean of a few frames, (H, W)."""
    return as_plane(reduce(np.add, planes) / np.float32(len(planes)))


def flicker(plane: Plane, mean: Plane) -> np.float32:
    """Return by which factor a frame is brighter than the mean: the median over bright pixels."""
    few = slice(None, None, 3), slice(None, None, 3)  # every third pixel gives the same median
    is_bright = mean[few] > _BRIGHT
    return (
        np.float32(np.median(plane[few][is_bright] / mean[few][is_bright]))
        if is_bright.any()
        else np.float32(1)
    )


def _change_beside_flicker(planes: list[Plane]) -> Plane:
    """Return the range of each pixel's brightness over time, (H, W), the flicker divided out."""
    mean = mean_of(planes)
    highest, lowest = np.full_like(mean, -np.inf), np.full_like(mean, np.inf)
    for plane in planes:
        left = as_plane(cv2.scaleAdd(mean, -float(flicker(plane, mean)), plane))
        np.maximum(highest, left, out=highest)
        np.minimum(lowest, left, out=lowest)
    return highest - lowest


def _widened_and_filled(moves: Plane) -> Plane:
    """Return the mask slightly dilated, with its holes filled and its edges softened."""
    height, width = moves.shape
    scale = min(1.0, _SIDE / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    # As bytes, on which OpenCV's morphology is several times as fast as on floats.
    small = cv2.convertScaleAbs(cv2.resize(moves, size, interpolation=cv2.INTER_AREA), alpha=255)
    near, core = _disc(size[1] * 0.012), _disc(size[1] * 0.05)
    filled = cv2.morphologyEx(cv2.dilate(small, near), cv2.MORPH_CLOSE, core)
    soft = cv2.blur(as_plane(filled) / np.float32(255), near.shape)
    return as_plane(cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR))


def _disc(radius: float) -> NDArray[np.uint8]:
    side = 2 * max(1, round(radius)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)).astype(np.uint8)
