"""Glow of bright light on what is around it, as hazy air and the glass of a lens scatter it."""

import math
from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import edge_fade
from fire_atlas.core.pixels import as_plane
from fire_atlas.vision.warp import between_copies

_SPREADS = 0.025, 0.06, 0.14
"""Standard deviations of the Gaussians that the glow is the sum of, heights, each with as much
light: so it falls steeply beside a flame, and slowly further away."""

_COARSE = 3.0
"""Standard deviation, samples of a smaller picture, at which a glow is as smooth as in a larger."""

_REACH = 4.0
"""Distance at which a Gaussian has ended, standard deviations."""

_EDGE = 0.12
"""Distance from the frame's edges over which the glow fades, heights, so that no box is seen."""


def scattered(
    light: NDArray[np.float32], scale: float, share: float, *, tiles: bool = False
) -> NDArray[np.float32]:
    """Return light (height, width, 3) that is scattered from HDR ``light`` of the same shape.

    Args:
        light: Linear light before it is exposed.
        scale: Pixels per height.
        share: Part of the light that is scattered.
        tiles: Whether it lies between copies of itself, whose light reaches it.
    """
    width = light.shape[1]
    margin = math.ceil(_REACH * max(_SPREADS) * scale) if tiles else 0
    around = between_copies(light, margin)
    glow = reduce(np.add, (blurred(around, spread * scale) for spread in _SPREADS))
    glow = glow[:, margin : margin + width]
    rows, columns = (edge_fade(length, _EDGE * scale) for length in light.shape[:2])
    columns = np.ones_like(columns) if tiles else columns
    weight = np.float32(share / len(_SPREADS)) * rows[:, None] * columns
    return np.asarray(np.maximum(glow, 0) * weight[..., None], np.float32)


def blurred(light: NDArray[np.float32], spread: float) -> NDArray[np.float32]:
    """Return ``light`` blurred by a Gaussian of standard deviation ``spread``, samples."""
    height, width = light.shape[:2]
    factor = min(1.0, _COARSE / spread)
    size = max(1, round(width * factor)), max(1, round(height * factor))
    small = cv2.resize(light, size, interpolation=cv2.INTER_AREA)
    # Nothing is known beyond the frame, so that light is lost there.
    wide = cv2.GaussianBlur(small, (0, 0), spread * factor, borderType=cv2.BORDER_CONSTANT)
    return as_plane(cv2.resize(wide, (width, height), interpolation=cv2.INTER_CUBIC))
