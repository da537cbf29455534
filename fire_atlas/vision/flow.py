"""Dense optical flow between two frames of a clip, by DIS (Kroeger et al., "Fast Optical Flow using
Dense Inverse Search", ECCV 2016) or by Farnebäck ("Two-Frame Motion Estimation Based on Polynomial
Expansion", SCIA 2003)."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane

SMALL = 300 * 300
"""Maximum area, px, of a small frame: its flow is estimated at full size, by a finer search."""

FLOW_AREA = 200 * 200
"""Larger frames are shrunk to about this area, px: that saves time, and is enough for the grid of
the buoyancy field."""

SMALLEST_SIDE = 64
"""Smaller frames are enlarged to this side, px, because DIS compares patches of several px."""

_WINDOW = 15
"""Side of the window, px, over which Farnebäck's flow is averaged."""

_LEVELS, _ITERATIONS = 5, 3
"""Halvings of the picture, and rounds on each, in Farnebäck's flow."""

_EXPANSION, _EXPANSION_SIGMA = 7, 1.5
"""Side, px, and standard deviation of a neighbourhood that a polynomial is fitted to. 5 and 1.2
leave up to 10 % more residual of motion vectors on the sample campfire and torch, in nine tenths
of the time."""


def flow_size(width: int, height: int, area: int) -> tuple[int, int]:
    """Return the size (width, height) at which flow is estimated: about ``area`` px at most."""
    scale = min(1.0, math.sqrt(area / (width * height)))
    scale = max(scale, SMALLEST_SIDE / min(width, height))
    return max(round(width * scale), SMALLEST_SIDE), max(round(height * scale), SMALLEST_SIDE)


def thumbnail(brightness: Plane, is_small: bool) -> Bytes:
    """Return the (h, w) uint8 copy of a brightness plane, 0..255, on which flow is estimated.

    ``is_small`` says whether the frame has at most ``SMALL`` px; the plane may be a part of it.
    """
    return thumbnail_of(brightness, brightness.size if is_small else FLOW_AREA)


def thumbnail_of(brightness: Plane, area: int) -> Bytes:
    """Return a (h, w) uint8 copy of a brightness plane, 0..255, of about ``area`` px at most."""
    size = flow_size(brightness.shape[1], brightness.shape[0], area)
    return np.asarray(cv2.convertScaleAbs(resized(brightness, size)), np.uint8)


def resized(picture: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Return a picture or plane resized to ``size`` (width, height)."""
    height, width = picture.shape[:2]
    if (width, height) == size:
        return picture
    method = cv2.INTER_AREA if size[0] <= width else cv2.INTER_LINEAR
    return as_plane(cv2.resize(picture, size, interpolation=method))


def shrunk_flow(
    velocity: NDArray[np.float32], shape: tuple[int, int], fps: float
) -> NDArray[np.float32]:
    """Convert a known ``velocity`` (H, W, 2), px/s, to flow (h, w, 2), px of a thumbnail."""
    (height, width), (h, w) = velocity.shape[:2], shape
    small = cv2.resize(velocity, (w, h), interpolation=cv2.INTER_AREA)
    return as_plane(small * np.array([w / (width * fps), h / (height * fps)], np.float32))


def optical_flow(
    before: Bytes, after: Bytes, is_small: bool, *, finest_scale: int = 1, refinements: int = 3
) -> NDArray[np.float32]:
    """Return the flow (h, w, 2), px, from ``before`` to ``after``, both (h, w) uint8.

    What ``before`` shows at p, ``after`` shows at p + flow(p).

    Args:
        before, after: The pictures.
        is_small: Whether they are small frames at full size, which need the finer search. Shrunk
            pictures are smooth: the coarser search finds as much in them.
        finest_scale: Finest pyramid level that is searched, 0 for full size. Above 1, half of the
            motion of turbulent fire is missed.
        refinements: Iterations of the variational refinement on each level.
    """
    preset = cv2.DISOPTICAL_FLOW_PRESET_MEDIUM if is_small else cv2.DISOPTICAL_FLOW_PRESET_FAST
    estimator = cv2.DISOpticalFlow.create(preset)
    estimator.setFinestScale(finest_scale)
    estimator.setVariationalRefinementIterations(refinements)
    return as_plane(estimator.calc(before, after, np.zeros((*before.shape, 2), np.float32)))


def farneback_flow(before: Bytes, after: Bytes) -> NDArray[np.float32]:
    """Return the flow (h, w, 2), px, from ``before`` to ``after``, both (h, w) uint8, as
    ``optical_flow`` does.

    Each neighbourhood of a picture is taken for a quadratic polynomial, and the shift between two
    polynomials is averaged over a window. Smoother than DIS: better where a picture is soft, worse
    at edges and where motion is long.
    """
    size = _EXPANSION, _EXPANSION_SIGMA
    flow = np.zeros((*before.shape, 2), np.float32)
    return as_plane(cv2.calcOpticalFlowFarneback(
        before, after, flow, 0.5, _LEVELS, _WINDOW, _ITERATIONS, *size, 0
    ))  # fmt: skip


def mean_flow(before: Bytes, after: Bytes, is_small: bool) -> float:
    """Return the mean length of the flow between two pictures, px, weighted by light."""
    flow = optical_flow(before, after, is_small)
    weight = before.astype(np.float32) + np.float32(1e-3)
    return float((np.hypot(flow[..., 0], flow[..., 1]) * weight).sum() / weight.sum())
