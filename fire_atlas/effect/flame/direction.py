"""Where a flame's gas goes: up, unless the clip clearly shows another direction."""

import math

import numpy as np

from fire_atlas.effect.flame.samples import FlameSamples

UP = (0.0, -1.0)
"""Unit vector, image axes."""

_MIN_SPEED = 0.08
"""Minimum mean velocity, heights/s: slower motion is sway, or drift of the camera."""

_MIN_COHERENCE = 0.7
"""Minimum of mean velocity / mean speed: gas that streams goes one way, flames that only flicker
go all ways."""

_MIN_AGREEMENT = 0.9
"""Minimum length of the sum of the runs' velocities, relative to the sum of their lengths."""

_MAX_LEAN = math.radians(25)
"""Fire that moves upwards to within this angle rises, and only leans."""


def flame_direction(samples: FlameSamples) -> tuple[float, float]:
    """Return the direction of the flame's mean motion, a unit vector in image axes.

    Fire that burns in calm air rises, so any other direction needs evidence: the flame is fast,
    its parts move alike, and do so throughout the clip.
    """
    total, count = samples.velocities.sum(axis=0), len(samples.velocities)
    length = float(np.hypot(*total))
    lengths = float(np.hypot(*samples.velocities.T).sum())
    if (
        length < _MIN_SPEED * count
        or length < _MIN_COHERENCE * samples.speed * count
        or length < _MIN_AGREEMENT * lengths
    ):
        return UP
    x, y = float(total[0]) / length, float(total[1]) / length
    return UP if -y >= math.cos(_MAX_LEAN) else (x, y)
