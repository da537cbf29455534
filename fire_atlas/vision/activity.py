"""Where a clip changes by itself, and not only with the light of its fire."""

from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane, as_plane

_SIDE = 320
"""Longest side, px, of the picture on which neighbourhoods of what moves are drawn."""

_LIT = 12.0
"""Brightness above which a place says something about the light."""


def activity(planes: list[Plane]) -> Plane:
    """How much each place changes over a few frames, with its neighbourhood: (H, W) in 0..1.

    What the fire lights flickers with it, everywhere by the same factor: that is taken out first.
    Where flame comes and goes a place changes by most of its brightness. The core of a steady
    flame does not change at all: it is surrounded by what does. A single frame moves everywhere.

    Args:
        planes: Brightness of the frames, 0..255.
    """
    if len(planes) == 1:
        return np.ones_like(planes[0])
    peak: Plane = reduce(np.maximum, planes)
    change = _own_change(planes)
    share = np.clip((change / (peak + 10.0) - 0.25) / 0.25, 0.0, 1.0)
    brightest = np.clip(peak / max(float(np.quantile(peak, 0.995)), 1.0) * 4.0 - 2.8, 0.0, 1.0)
    moves = np.clip((change - 8.0) / 24.0, 0.0, 1.0) * np.maximum(share, brightest)
    return _with_neighbourhood(as_plane(moves))


def mean_of(planes: list[Plane]) -> Plane:
    """Mean of a few frames, (H, W)."""
    return as_plane(reduce(np.add, planes) / np.float32(len(planes)))


def flicker(plane: Plane, mean: Plane) -> np.float32:
    """Factor by which the light of a frame differs from the mean: the median over lit places."""
    few = slice(None, None, 3), slice(None, None, 3)  # the median of some is that of all
    lit = mean[few] > _LIT
    return np.float32(np.median(plane[few][lit] / mean[few][lit])) if lit.any() else np.float32(1)


def _own_change(planes: list[Plane]) -> Plane:
    """Spread over time of each place's brightness, (H, W), less what the whole scene shares."""
    mean = mean_of(planes)
    highest, lowest = np.full_like(mean, -np.inf), np.full_like(mean, np.inf)
    for plane in planes:
        left = as_plane(cv2.scaleAdd(mean, -float(flicker(plane, mean)), plane))
        np.maximum(highest, left, out=highest)
        np.minimum(lowest, left, out=lowest)
    return highest - lowest


def _with_neighbourhood(moves: Plane) -> Plane:
    """Widen what moves a little, and fill what it surrounds."""
    height, width = moves.shape
    scale = min(1.0, _SIDE / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    # In bytes: their neighbourhoods are found several times as fast.
    small = cv2.convertScaleAbs(cv2.resize(moves, size, interpolation=cv2.INTER_AREA), alpha=255)
    near, core = _disc(size[1] * 0.012), _disc(size[1] * 0.05)
    filled = cv2.morphologyEx(cv2.dilate(small, near), cv2.MORPH_CLOSE, core)
    soft = cv2.blur(as_plane(filled) / np.float32(255), near.shape)
    return as_plane(cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR))


def _disc(radius: float) -> NDArray[np.uint8]:
    side = 2 * max(1, round(radius)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)).astype(np.uint8)
