"""Choose the vectors of one frame's cell: they serve both the step into the frame and the step out
of it, extend a little beyond the flame, and are 0 where nothing moves."""

from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.maps.vectors.flow import StepMotion, Vectors
from fire_atlas.maps.vectors.steps import Steps
from fire_atlas.vision.warp import over_channels

PAD, PAD_SHARE = 8, 0.1
"""Vectors extend beyond the flame by this many frame px or, if that is more, this fraction of the
frame's longer side."""

_PRIOR_WEIGHT = 0.1
"""Weight of "no motion" beside the two measured motions: it shrinks uncertain vectors towards 0."""

_VISIBLE = 3
"""Pixels with light or coverage above this, of 255, belong to the flame."""

_UNCHANGED, _CHANGED = 1.0, 3.0
"""Where two frames differ (root mean square, of 255) by at most the first, vectors are 0; from the
second on they are kept whole. Places that hardly change blend well as they are; vectors would only
make them wobble."""

_NEIGHBOURHOOD = 1 / 24
"""Standard deviation over which this difference is measured, as a fraction of the longer side."""


def cell_vectors(steps: Steps, frame: int, span: int, reliability: Plane, pad: float) -> Vectors:
    """Return the vectors (h, w, 2) of a frame's cell, in px of the pictures per step.

    Args:
        steps: Motion of the animation; those into the frame and out of it are known.
        frame: Number of the frame.
        span: Frames of the animation from one that is played to the next.
        reliability: (h, w), 0..1, factor of the vectors.
        pad: Distance from the flame at which vectors begin to fade, px.
    """
    before, here, after = (steps.picture(i) for i in (frame - span, frame, frame + span))
    motions = steps.motion((frame - span, frame)), steps.motion((frame, frame + span))
    wanted = np.maximum(change_weight(before, here), change_weight(here, after))
    vectors = as_plane(_mean_motion(motions) * (reliability * wanted)[..., None])
    shown = brightest(cv2.max(cv2.max(before, here), after))
    return extended(vectors, np.asarray(shown > _VISIBLE), pad)


def _mean_motion(steps: tuple[StepMotion | None, StepMotion | None]) -> Vectors:
    """Return the mean of the motions into a frame and out of it, weighted by their confidence.

    An engine moves a frame by its own vectors both while it fades in and while it fades out: the
    mean serves both steps better than either motion.
    """
    known = [step for step in steps if step is not None]
    weights = [step.confidence.astype(np.float32) for step in known]
    parts = [step.vectors * w[..., None] for step, w in zip(known, weights, strict=True)]
    scale = (1 + _PRIOR_WEIGHT) / (reduce(np.add, weights) + _PRIOR_WEIGHT * len(known))
    return as_plane(reduce(np.add, parts) * scale[..., None])


def change_weight(before: Bytes, after: Bytes) -> Plane:
    """Return the factor of vectors, (h, w) in 0..1: 0 where two pictures hardly differ."""
    square = as_plane(over_channels(cv2.absdiff(before, after).astype(np.float32) ** 2) / 4)
    change = np.sqrt(cv2.GaussianBlur(square, (0, 0), _NEIGHBOURHOOD * max(square.shape)))
    return as_plane(np.clip((change - _UNCHANGED) / (_CHANGED - _UNCHANGED), 0, 1))


def extended(vectors: Vectors, flame: NDArray[np.bool_], pad: float) -> Vectors:
    """Return ``vectors`` continued beyond the ``flame`` (h, w) for ``pad`` px, then fading to 0.

    Each px outside has the vector of the nearest px of the flame, smoothed: soft edges then move
    with the flame, and the empty background does not move.
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
