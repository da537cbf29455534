"""Dense optical flow of the clip: how the flame moves."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane

FLOW_AREA = 300 * 300
"""Most px of the pictures that flow is estimated on: the grid needs no more, and it takes time."""

_SMALLEST_SIDE = 64
"""Smaller pictures are enlarged: the estimator's patches need room."""


def flow_size(width: int, height: int) -> tuple[int, int]:
    """Size (width, height) at which the flow of a ``width`` by ``height`` clip is estimated."""
    scale = min(1.0, math.sqrt(FLOW_AREA / (width * height)))
    scale = max(scale, _SMALLEST_SIDE / min(width, height))
    return max(round(width * scale), _SMALLEST_SIDE), max(round(height * scale), _SMALLEST_SIDE)


def thumbnail(brightness: Plane) -> Bytes:
    """Return the (h, w) uint8 copy of a brightness plane, 0..255, that flow is estimated on."""
    height, width = brightness.shape
    size = flow_size(width, height)
    shrinks = size[0] <= width
    small = cv2.resize(
        brightness, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    )
    return np.clip(np.rint(small), 0, 255).astype(np.uint8)


def shrunk_flow(
    velocity: NDArray[np.float32], shape: tuple[int, int], fps: float
) -> NDArray[np.float32]:
    """Known ``velocity`` (H, W, 2) of a frame, px/s, as flow (h, w, 2) in px of its thumbnail."""
    (height, width), (h, w) = velocity.shape[:2], shape
    small = cv2.resize(velocity, (w, h), interpolation=cv2.INTER_AREA)
    return as_plane(small * np.array([w / (width * fps), h / (height * fps)], np.float32))


def optical_flow(before: Bytes, after: Bytes, is_shrunk: bool) -> NDArray[np.float32]:
    """Flow (h, w, 2) in px of the thumbnails from ``before`` to ``after``, both (h, w) uint8.

    Where ``before`` has something at p, ``after`` has it at p + flow(p). Dense inverse search
    (DIS), down to its second finest level: without that half of what turbulent fire does is lost.
    Pictures that were shrunk are smooth, and a coarser search finds as much in them.
    """
    preset = cv2.DISOPTICAL_FLOW_PRESET_FAST if is_shrunk else cv2.DISOPTICAL_FLOW_PRESET_MEDIUM
    estimator = cv2.DISOpticalFlow.create(preset)
    estimator.setFinestScale(1)
    estimator.setVariationalRefinementIterations(3)
    return as_plane(estimator.calc(before, after, np.zeros((*before.shape, 2), np.float32)))
