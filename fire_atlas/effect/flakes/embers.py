"""How an ember looks: it cools, dims, twinkles, and its colour tells its speed."""

import math

import numpy as np
from numpy.typing import NDArray

HOTTEST, COOLEST = 1600.0, 980.0
"""Temperature, K, at birth and where an ember is no longer seen."""

_WIEN = 23930.0
"""Luminance grows as exp(−_WIEN / T): × 7,900 from 1000 K to 1600 K."""

_EXPOSURE = 0.32
"""Contrast of the picture against that of nature, as an eye or a film would hold it."""

_KINDLING = 0.05
"""Seconds in which a new ember comes to light."""

_TWINKLE_DEPTH = 0.4

_FULL_SPEED = 0.9
"""Speed, heights/s, that has the last colour of the ramp."""


def temperature(age_share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Temperature, K, of embers that have lived ``age_share`` (0..1) of their life.

    Radiation cools hot embers faster than dull ones.
    """
    return COOLEST + (HOTTEST - COOLEST) * (1 - np.clip(age_share, 0, 1)) ** 1.4


def glow(age: NDArray[np.float64], life: NDArray[np.float64]) -> NDArray[np.float64]:
    """Light, 0..1, of embers ``age`` s old that live ``life`` s: 0 at the end, without a step."""
    strength = _WIEN * _EXPOSURE
    heat = np.exp(strength * (1 / HOTTEST - 1 / temperature(age / life)))
    dullest = math.exp(strength * (1 / HOTTEST - 1 / COOLEST))
    lit = np.minimum(age / _KINDLING, 1.0)
    return np.maximum(heat - dullest, 0.0) / (1 - dullest) * lit


def twinkle(
    age: NDArray[np.float64], rate: NDArray[np.float64], phase: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Factor up to 1 by which an ember flickers; ``rate`` Hz, ``phase`` rad."""
    return 1 - _TWINKLE_DEPTH * (0.5 - 0.5 * np.sin(2 * np.pi * rate * age + phase))


def colour_by_speed(
    speed: NDArray[np.float64], height: int, stops: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Colour (3, flakes), linear, of flakes at ``speed`` px/s in frames of ``height`` px."""
    at = np.clip(speed / (_FULL_SPEED * height), 0, 1) * (len(stops) - 1)
    known = np.arange(len(stops))
    return np.stack([np.interp(at, known, stops[:, c]) for c in range(3)])
