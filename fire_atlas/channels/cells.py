"""Choose the vectors of one frame's cell: they serve both the step into the frame and the one out
of it, go on a little beyond the edge of the flame, and are 0 where nothing moves."""

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.flow import StepMotion, Vectors
from fire_atlas.core.pixels import Bytes, Plane, as_plane

PAD, PAD_SHARE = 8, 0.1
"""Vectors go on as at the edge for so many px of the frame, or this share of its longer side."""

_PRIOR_WEIGHT = 0.1
"""Weight of "no motion" beside the two measured ones: unsure vectors are shrunk towards 0."""

_VISIBLE = 3
"""Light or coverage above this, of 255, is part of the flame."""

_UNCHANGED, _CHANGED = 1.0, 3.0
"""Where two frames differ by so few of 255 steps (root mean square) no vector is wanted, from so
many on all of it: what hardly changes blends well as it is, and would only swim."""

_NEIGHBOURHOOD = 1 / 24
"""Standard deviation over which change is measured, as a share of the longer side."""


def cell_vectors(
    steps: tuple[StepMotion | None, StepMotion | None],
    pictures: tuple[Bytes, Bytes, Bytes],
    reliability: Plane,
    pad: float,
) -> Vectors:
    """Return the vectors (h, w, 2) that go into a frame's cell, px of the picture a frame.

    Args:
        steps: The motions into the frame and out of it; one of them may be None.
        pictures: The frame before, the frame, the frame after.
        reliability: (h, w), 0..1, the share of a vector that is used.
        pad: px beyond the flame at which vectors begin to fade.
    """
    before, here, after = pictures
    wanted = np.maximum(change_weight(before, here), change_weight(here, after))
    vectors = as_plane(_mean_motion(steps) * (reliability * wanted)[..., None])
    shown = np.asarray(cv2.max(cv2.max(before, here), after), np.uint8)
    return extended(vectors, np.asarray(shown.max(axis=2) > _VISIBLE), pad)


def _mean_motion(steps: tuple[StepMotion | None, StepMotion | None]) -> Vectors:
    """Return the mean of the motions into a frame and out of it, weighted by their confidence.

    An engine moves a frame by its own vectors both while it comes and while it goes: their mean
    serves both steps better than the motion of either.
    """
    known = [step for step in steps if step is not None]
    weights = [step.confidence.astype(np.float32) for step in known]
    parts = [step.vectors * w[..., None] for step, w in zip(known, weights, strict=True)]
    scale = (1 + _PRIOR_WEIGHT) / (np.sum(weights, axis=0) + _PRIOR_WEIGHT * len(known))
    return as_plane(np.sum(parts, axis=0) * scale[..., None])


def change_weight(before: Bytes, after: Bytes) -> Plane:
    """Return (h, w), 0..1: how much of a vector is wanted where two pictures differ so much."""
    square = as_plane(np.mean(cv2.absdiff(before, after).astype(np.float32) ** 2, axis=2))
    change = np.sqrt(cv2.GaussianBlur(square, (0, 0), _NEIGHBOURHOOD * max(square.shape)))
    return as_plane(np.clip((change - _UNCHANGED) / (_CHANGED - _UNCHANGED), 0, 1))


def extended(vectors: Vectors, flame: NDArray[np.bool_], pad: float) -> Vectors:
    """Return ``vectors`` continued beyond the ``flame`` (h, w) for ``pad`` px, then fading to 0.

    Each px beyond has the vector of the flame's nearest, smoothed among its neighbours: fringes
    move with the flame, the empty background does not.
    """
    if not flame.any():
        return np.zeros_like(vectors)
    if flame.all():
        return vectors
    distance, labels = cv2.distanceTransformWithLabels(
        (~flame).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = np.zeros((int(labels.max()) + 1, 2), np.float32)
    nearest[labels[flame]] = vectors[flame]
    spread, sigma = nearest[labels], max(pad / 4, 1.0)
    smooth = as_plane(cv2.GaussianBlur(spread, (0, 0), sigma))
    beyond = spread + (smooth - spread) * np.clip(distance / sigma, 0, 1)[..., None]
    fading = np.clip(2 - distance / pad, 0, 1)[..., None]
    return as_plane(np.where(flame[..., None], vectors, beyond * fading))
