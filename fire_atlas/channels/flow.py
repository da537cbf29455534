"""How the picture moves halfway between two frames, seen in their pixels from both sides."""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import BlendSpace, encode_frame
from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, magnitude

Vectors = NDArray[np.float32]
"""(h, w, 2) float32: x right, y down, px a frame."""

_AREA = 200 * 200
"""Most px of the pictures that are compared. Held out frames of real fire are met as well from
these as from larger ones, and the vectors' map is smooth."""

_SMALLEST_SIDE = 96
"""Smaller pictures are enlarged: the estimator's patches need room."""

_COVERAGE = 0.3
"""Share of coverage beside light in what is compared: dark smoke moves too."""

_SLIP, _SLIP_SHARE = 0.75, 0.35
"""Where the ways there and back miss each other by so many px, and so much of the way, their
mean is half sure."""


class Halfway(NamedTuple):
    """Motion between two frames, at the places where things are halfway.

    Attributes:
        vectors: (h, w, 2), px of the picture a frame: what is at p then was at p − v/2 in the one
            frame and will be at p + v/2 in the other.
        sure: (h, w), 0..1: 1 where the ways there and back agree.
    """

    vectors: NDArray[np.float16]
    sure: NDArray[np.float16]


def picture(pixels: Pixels, blend_space: BlendSpace) -> Bytes:
    """Return pixels (H, W, 4) as a client shows them, small: (h, w, 4) uint8, premultiplied."""
    height, width = pixels.shape[:2]
    scale = min(1.0, math.sqrt(_AREA / (width * height)))
    size = tuple(max(round(side * scale), _SMALLEST_SIDE) for side in (width, height))
    shrinks = size[0] <= width and size[1] <= height
    way = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    return encode_frame(as_plane(cv2.resize(pixels, size, interpolation=way)), "premultiplied",
                        blend_space)  # fmt: skip


def halfway(before: Bytes, after: Bytes) -> Halfway:
    """Return the motion between two pictures (h, w, 4)."""
    one, other = _seen(before), _seen(after)
    there, back = _flow(one, other), _flow(other, one)
    vectors = as_plane((there - back) / 2)
    for _ in range(2):  # each way starts in its own frame, half the motion away
        here, hence = warped(there, vectors, -0.5), warped(back, vectors, 0.5)
        vectors = as_plane((here - hence) / 2)
    slip, length = length_of(as_plane(here + hence)), length_of(vectors)
    sure = 1 / (1 + (slip / (_SLIP + _SLIP_SHARE * length)) ** 2)
    return Halfway(vectors.astype(np.float16), sure.astype(np.float16))


def warped(image: NDArray[np.float32], vectors: Vectors, share: float) -> NDArray[np.float32]:
    """Return at each p what ``image`` (h, w, ...) has at p + ``share`` · vectors(p)."""
    height, width = vectors.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    part = np.float32(share)
    return as_plane(cv2.remap(
        image, x + vectors[..., 0] * part, y + vectors[..., 1] * part, cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    ))  # fmt: skip


def length_of(vectors: Vectors) -> Plane:
    """Return the lengths (h, w) of vectors."""
    return magnitude(vectors[..., 0], vectors[..., 1])


def _seen(shown: Bytes) -> Bytes:
    """Return what is compared, (h, w) uint8: light, and coverage beside it."""
    light = (1 - _COVERAGE) / 3
    weights = np.array([[light, light, light, _COVERAGE]], np.float32)
    return np.asarray(cv2.transform(shown, weights), np.uint8)


def _flow(before: Bytes, after: Bytes) -> Vectors:
    """Dense inverse search (DIS) down to the finest level, smoothed by variational refinement."""
    estimator = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    estimator.setFinestScale(0)
    return as_plane(estimator.calc(before, after, np.zeros((*before.shape, 2), np.float32)))
