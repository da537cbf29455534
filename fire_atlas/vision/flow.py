"""Dense optical flow between two small pictures of a clip (dense inverse search, Kroeger et al.,
"Fast Optical Flow using Dense Inverse Search", ECCV 2016)."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane

SMALL = 300 * 300
"""Frames of at most so many px are compared at their own size, with the finer of two searches."""

FLOW_AREA = 200 * 200
"""Most px of the pictures on which the flow of larger frames is estimated: shrunk, these are
smooth; the grid of the buoyancy field needs no more, and it takes time."""

SMALLEST_SIDE = 64
"""Smaller pictures are enlarged to this side, px: the estimator's patches need room."""


def flow_size(width: int, height: int, area: int) -> tuple[int, int]:
    """Size (width, height), of about ``area`` px at most, at which flow is estimated."""
    scale = min(1.0, math.sqrt(area / (width * height)))
    scale = max(scale, SMALLEST_SIDE / min(width, height))
    return max(round(width * scale), SMALLEST_SIDE), max(round(height * scale), SMALLEST_SIDE)


def thumbnail(brightness: Plane, is_small: bool) -> Bytes:
    """Return the (h, w) uint8 copy of a brightness plane, 0..255, that flow is estimated on.

    ``is_small``: whether the whole frame, of which the plane may be a part, has at most ``SMALL``
    px.
    """
    return thumbnail_of(brightness, brightness.size if is_small else FLOW_AREA)


def thumbnail_of(brightness: Plane, area: int) -> Bytes:
    """Return the (h, w) uint8 copy of a brightness plane, 0..255, of about ``area`` px at most."""
    size = flow_size(brightness.shape[1], brightness.shape[0], area)
    return np.asarray(cv2.convertScaleAbs(resized(brightness, size)), np.uint8)


def resized(picture: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return a picture or plane at another (width, height)."""
    height, width = picture.shape[:2]
    if (width, height) == size:
        return picture
    method = cv2.INTER_AREA if size[0] <= width else cv2.INTER_LINEAR
    return as_plane(cv2.resize(picture, size, interpolation=method))


def shrunk_flow(
    velocity: NDArray[np.float32], shape: tuple[int, int], fps: float
) -> NDArray[np.float32]:
    """Known ``velocity`` (H, W, 2) of a frame, px/s, as flow (h, w, 2) in px of its thumbnail."""
    (height, width), (h, w) = velocity.shape[:2], shape
    small = cv2.resize(velocity, (w, h), interpolation=cv2.INTER_AREA)
    return as_plane(small * np.array([w / (width * fps), h / (height * fps)], np.float32))


def optical_flow(
    before: Bytes, after: Bytes, is_small: bool, *, finest_scale: int = 1, refinements: int = 3
) -> NDArray[np.float32]:
    """Flow (h, w, 2) in px from ``before`` to ``after``, both (h, w) uint8, by DIS.

    Where ``before`` has something at p, ``after`` has it at p + flow(p).

    Args:
        before, after: The pictures, in this order.
        is_small: Whether they are small frames at their own size, which need a fine search: in
            shrunk pictures a coarser one finds as much.
        finest_scale: Pyramid level down to which flow is searched, 0 for the full size. Above 1,
            half of the motion of turbulent fire is lost.
        refinements: Iterations of the variational refinement on each level.
    """
    preset = cv2.DISOPTICAL_FLOW_PRESET_MEDIUM if is_small else cv2.DISOPTICAL_FLOW_PRESET_FAST
    estimator = cv2.DISOpticalFlow.create(preset)
    estimator.setFinestScale(finest_scale)
    estimator.setVariationalRefinementIterations(refinements)
    return as_plane(estimator.calc(before, after, np.zeros((*before.shape, 2), np.float32)))


def mean_flow(before: Bytes, after: Bytes, is_small: bool) -> float:
    """Mean length of the flow between two pictures, px, weighted by the light of the first."""
    flow = optical_flow(before, after, is_small)
    weight = before.astype(np.float32) + np.float32(1e-3)
    return float((np.hypot(flow[..., 0], flow[..., 1]) * weight).sum() / weight.sum())
