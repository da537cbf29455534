"""Estimate the motion halfway between two frames, from the optical flow in both directions."""

import math
from typing import Literal, NamedTuple, TypeAlias, assert_never

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import BlendSpace, encode_frame
from fire_atlas.core.pixels import Bytes, Pixels, as_plane, magnitude
from fire_atlas.vision.flow import farneback_flow, optical_flow
from fire_atlas.vision.warp import warp_by_pixels

Vectors = NDArray[np.float32]
"""(h, w, 2) float32: x right, y down, px per frame."""

Method: TypeAlias = Literal["dis", "farneback"]
"""A method of optical flow: dense inverse search, or Farnebäck's polynomials."""

_MAX_AREA = 200 * 200
"""Maximum area of the pictures that are compared, px². They predict held-out frames of real fire as
well as larger ones do, and the map of vectors is smooth."""

_MIN_SIDE = 96
"""Minimum side of these pictures, px: optical flow compares patches, which need room."""

_COVERAGE_WEIGHT = 0.3
"""Weight of coverage, beside light, in the pictures that are compared: dark smoke moves too."""

_MISMATCH, _MISMATCH_SHARE = 0.75, 0.35
"""Confidence is one half where forward and backward flow disagree by this many px plus this
fraction of their length."""


class StepMotion(NamedTuple):
    """Motion between two frames, at the time halfway between them.

    Attributes:
        vectors: (h, w, 2), px of the pictures per frame: what is halfway at p was at p − v/2 in the
            first frame and will be at p + v/2 in the second.
        confidence: (h, w), 0..1: 1 where forward and backward flow agree.
    """

    vectors: NDArray[np.float16]
    confidence: NDArray[np.float16]


def displayed_thumbnail(pixels: Pixels, blend_space: BlendSpace) -> Bytes:
    """Return pixels (H, W, 4) small and as an engine shows them: (h, w, 4) uint8, premultiplied."""
    height, width = pixels.shape[:2]
    scale = min(1.0, math.sqrt(_MAX_AREA / (width * height)))
    size = tuple(max(round(side * scale), _MIN_SIDE) for side in (width, height))
    shrinks = size[0] <= width and size[1] <= height
    method = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    small = as_plane(cv2.resize(pixels, size, interpolation=method))
    return encode_frame(small, "premultiplied", blend_space)


def step_motion(before: Bytes, after: Bytes, method: Method) -> StepMotion:
    """Return the motion between two pictures (h, w, 4), by that method."""
    one, other = _grey(before), _grey(after)
    forward, backward = _flow(one, other, method), _flow(other, one, method)
    vectors = as_plane((forward - backward) / 2)
    for _ in range(2):  # each flow starts in its own frame, half the motion away
        ahead = warp_by_pixels(forward, vectors, -0.5)
        back = warp_by_pixels(backward, vectors, 0.5)
        vectors = as_plane((ahead - back) / 2)
    mismatch = as_plane(ahead + back)
    tolerance = _MISMATCH + _MISMATCH_SHARE * magnitude(vectors[..., 0], vectors[..., 1])
    confidence = 1 / (1 + (magnitude(mismatch[..., 0], mismatch[..., 1]) / tolerance) ** 2)
    return StepMotion(vectors.astype(np.float16), confidence.astype(np.float16))


def _grey(shown: Bytes) -> Bytes:
    """Return a weighted mean of light and coverage, (h, w) uint8, to estimate flow on."""
    light = (1 - _COVERAGE_WEIGHT) / 3
    weights = np.array([[light, light, light, _COVERAGE_WEIGHT]], np.float32)
    return np.asarray(cv2.transform(shown, weights), np.uint8)


def _flow(before: Bytes, after: Bytes, method: Method) -> Vectors:
    match method:
        case "dis":  # refined down to the full size, as errors would be visible in the engine
            return optical_flow(before, after, True, finest_scale=0, refinements=5)
        case "farneback":
            return farneback_flow(before, after)
        case _:
            assert_never(method)
