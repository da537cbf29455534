"""Vectors beyond the edge of the flame: fringes move with it, the empty background does not."""

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.flow import Vectors
from fire_atlas.core.pixels import Bytes, Plane, as_plane

PAD, PAD_SHARE = 8, 0.1
"""Vectors go on as at the edge for so many px of the frame, or this share of its longer side."""

_VISIBLE = 3
"""Light or coverage above this, of 255, is part of the flame."""

_CALM, _RESTLESS = 1.0, 3.0
"""Where two frames differ by so few of 255 steps (root mean square) no vector is wanted, from so
many on all of it: what hardly changes blends well as it is, and would only swim."""

_AROUND = 1 / 24
"""Distance over which that is looked at, as a share of the longer side."""


def visible(shown: Bytes) -> NDArray[np.bool_]:
    """Return where a picture (h, w, 4) shows anything."""
    return np.asarray(shown.max(axis=2) > _VISIBLE)


def restless(before: Bytes, after: Bytes) -> Plane:
    """Return (h, w), 0..1: how much of a vector is wanted where two pictures differ so much."""
    square = as_plane(np.mean(cv2.absdiff(before, after).astype(np.float32) ** 2, axis=2))
    change = np.sqrt(cv2.GaussianBlur(square, (0, 0), _AROUND * max(square.shape)))
    return as_plane(np.clip((change - _CALM) / (_RESTLESS - _CALM), 0, 1))


def padded(vectors: Vectors, flame: NDArray[np.bool_], reach: float) -> Vectors:
    """Return ``vectors`` continued beyond the ``flame`` (h, w) for ``reach`` px, then fading to 0.

    Each px beyond has the vector of the flame's nearest, smoothed among its neighbours.
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
    spread = nearest[labels]
    smooth = as_plane(cv2.GaussianBlur(spread, (0, 0), max(reach / 4, 1.0)))
    beyond = np.clip(distance / max(reach / 4, 1.0), 0, 1)[..., None]
    fading = np.clip(2 - distance / reach, 0, 1)[..., None]
    return as_plane(
        np.where(flame[..., None], vectors, (spread + (smooth - spread) * beyond) * fading)
    )
