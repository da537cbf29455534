"""Clips that close: after the last frame the first follows as any frame follows another."""

import numpy as np

from fire_atlas.vision.sampling import Samples
from fire_atlas.vision.thumbnails import distance

SEAM = 1.25
"""A seam this many times the median step is no more seen than the steps are."""


def is_closed(samples: Samples) -> bool:
    """Whether the step from the last frame to the first is like those in between."""
    if samples.count < 3:
        return False
    return distance(samples.last, samples.first) <= SEAM * float(np.median(samples.steps()))
