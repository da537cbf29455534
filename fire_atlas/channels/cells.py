"""The vectors of one frame's cell, which serve the step into the frame and the one out of it."""

import cv2
import numpy as np

from fire_atlas.channels.flow import Halfway, Vectors
from fire_atlas.channels.margin import padded, restless, visible
from fire_atlas.core.pixels import Bytes, Plane, as_plane

_DOUBT = 0.1
"""Of two unsure motions the mean is shrunk, the more the less sure they are against this."""


def joined(before: Halfway | None, after: Halfway | None) -> Vectors:
    """Return the mean of the motions into a frame and out of it, by how sure each is.

    A client moves a frame by its own vectors both while it comes and while it goes: their mean
    serves both steps better than the motion of either. A step is None where there is none, but not
    both.
    """
    steps = [step for step in (before, after) if step is not None]
    sure = [step.sure.astype(np.float32) for step in steps]
    parts = [step.vectors * weight[..., None] for step, weight in zip(steps, sure, strict=True)]
    share = (1 + _DOUBT) / (np.sum(sure, axis=0) + _DOUBT * len(steps))
    return as_plane(np.sum(parts, axis=0) * share[..., None])


def cell_vectors(
    steps: tuple[Halfway | None, Halfway | None],
    pictures: tuple[Bytes, Bytes, Bytes],
    reliability: Plane,
    pad: float,
) -> Vectors:
    """Return the vectors (h, w, 2) that go into a frame's cell, px of the picture a frame.

    Args:
        steps: The motions into the frame and out of it.
        pictures: The frame before, the frame, the frame after.
        reliability: (h, w), 0..1, the share of a vector that is used.
        pad: px beyond the flame at which vectors begin to fade.
    """
    before, here, after = pictures
    wanted = np.maximum(restless(before, here), restless(here, after))
    vectors = as_plane(joined(*steps) * (reliability * wanted)[..., None])
    flame = visible(np.asarray(cv2.max(cv2.max(before, here), after), np.uint8))
    return padded(vectors, flame, pad)
