"""Dense optical flow of the clip: how the flame moves."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane

SMALL = 300 * 300
"""Frames of at most so many px are looked at as they are, and closely."""

FLOW_AREA = 200 * 200
"""Most px of the pictures on which the flow of larger frames is estimated: shrunk, these are
smooth; the grid needs no more, and it takes time."""

SMALLEST_SIDE = 64
"""Smaller pictures are enlarged: the estimator's patches need room."""


def flow_size(width: int, height: int, area: int) -> tuple[int, int]:
    """Size (width, height), of about ``area`` px at most, at which flow is estimated."""
    scale = min(1.0, math.sqrt(area / (width * height)))
    scale = max(scale, SMALLEST_SIDE / min(width, height))
    return max(round(width * scale), SMALLEST_SIDE), max(round(height * scale), SMALLEST_SIDE)


def thumbnail(brightness: Plane, is_small: bool) -> Bytes:
    """Return the (h, w) uint8 copy of a brightness plane, 0..255, that flow is estimated on.

    ``is_small`` tells whether the frame that the plane is a part of is.
    """
    height, width = brightness.shape
    area = width * height if is_small else FLOW_AREA
    return picture_of(brightness, flow_size(width, height, area))


def picture_of(brightness: Plane, size: tuple[int, int]) -> Bytes:
    """Return the (h, w) uint8 copy of a brightness plane, 0..255, at another (width, height)."""
    shrinks = size[0] <= brightness.shape[1]
    small = cv2.resize(
        brightness, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    )
    return np.asarray(cv2.convertScaleAbs(small), np.uint8)


def shrunk_flow(
    velocity: NDArray[np.float32], shape: tuple[int, int], fps: float
) -> NDArray[np.float32]:
    """Known ``velocity`` (H, W, 2) of a frame, px/s, as flow (h, w, 2) in px of its thumbnail."""
    (height, width), (h, w) = velocity.shape[:2], shape
    small = cv2.resize(velocity, (w, h), interpolation=cv2.INTER_AREA)
    return as_plane(small * np.array([w / (width * fps), h / (height * fps)], np.float32))


def optical_flow(before: Bytes, after: Bytes, is_small: bool) -> NDArray[np.float32]:
    """Flow (h, w, 2) in px of the thumbnails from ``before`` to ``after``, both (h, w) uint8.

    Where ``before`` has something at p, ``after`` has it at p + flow(p). Dense inverse search
    (DIS), down to its second finest level: without that half of what turbulent fire does is lost.
    In pictures of larger frames a coarser search finds as much as in small ones a fine one.
    """
    preset = cv2.DISOPTICAL_FLOW_PRESET_MEDIUM if is_small else cv2.DISOPTICAL_FLOW_PRESET_FAST
    estimator = cv2.DISOpticalFlow.create(preset)
    estimator.setFinestScale(1)
    estimator.setVariationalRefinementIterations(3)
    return as_plane(estimator.calc(before, after, np.zeros((*before.shape, 2), np.float32)))
