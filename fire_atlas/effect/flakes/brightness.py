"""Brightness: how much light an ember gives, over its life and from moment to moment.

Filmed embers differ by orders of magnitude. They hold their light for a while and then die, and
flicker as air and ash pass over them.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.effect.flakes.emission import TICK

Column = NDArray[np.float64]

_MEDIAN, _SPREAD = 1.35, 1.85
"""Median light of embers, and standard deviation of its logarithm."""

_HOT_SHARE, _HOTTEST = 0.14, 650.0
"""Share of embers that may overexpose the film, and the light of the hottest: between it and that
of the least hot of them, all degrees are as frequent."""

_HOT_SCORE = 1.0803
"""Standard score of the quantile 1 − ``_HOT_SHARE``."""

_TABLE_END, _TABLE_STEPS = 5.0, 2001

_BORN_LIGHT, _RISEN = 0.55, 0.25
"""Fraction of its full light that a new ember gives, and of its life at which it reaches all of
it: out of the flame, fresh air fans it."""

_HELD = (0.0, 0.45)
"""Minimum and maximum fraction of its life from which an ember dies: some have more to burn."""

_FLICKER = 0.5
"""Standard deviation of the logarithm of an ember's light by flicker."""

_FLICKER_TIME = 0.13
"""Time, s, in which the correlation of flicker falls to 1/e."""


def ember_brightness(count: int, seed: int) -> Column:
    """Return the light, linear, of each of ``count`` embers at its brightest, (count,).

    It is log-normal, but for the few hottest. The embers share out the quantiles of the
    distribution at random, so that even a few show its whole spread.
    """
    place = generator(seed, RandomStream.LIGHT).permutation(count)
    quantile = (place + 0.5) / max(count, 1)
    light = _MEDIAN * np.exp(_SPREAD * _normal_quantile(quantile))
    degree = np.maximum(quantile / _HOT_SHARE - (1 / _HOT_SHARE - 1), 0.0)
    least = _MEDIAN * math.exp(_SPREAD * _HOT_SCORE)
    return np.where(degree > 0, least * (_HOTTEST / least) ** degree, light)


def defocus(count: int, share: float, seed: int) -> Column:
    """Return how far each of ``count`` embers is out of focus, 0..1: a ``share`` of them, at
    random, by all degrees."""
    place = generator(seed, RandomStream.LIGHT, 1).permutation(count)
    return np.clip(1 - (place + 0.5) / max(count, 1) / share, 0.0, 1.0)


def _normal_quantile(quantile: Column) -> Column:
    """Return the standard scores of quantiles between 0 and 1, to about 1e-3."""
    score = np.linspace(-_TABLE_END, _TABLE_END, _TABLE_STEPS)
    below = [0.5 + 0.5 * math.erf(z / math.sqrt(2)) for z in score.tolist()]
    return np.interp(quantile, below, score)


def held_share(count: int, seed: int) -> Column:
    """Return the fraction of its life from which each of ``count`` embers dies, (count,)."""
    return generator(seed, RandomStream.LIGHT, 2).uniform(*_HELD, count)


def light_over_life(age_share: Column, held: Column) -> Column:
    """Return the light, 0..1, of embers that have lived ``age_share`` (0..1) of their lifetime.

    They die from ``held`` of it on, evenly.
    """
    risen = _BORN_LIGHT + (1 - _BORN_LIGHT) * np.minimum(age_share / _RISEN, 1.0)
    return risen * np.clip((1 - age_share) / (1 - held), 0.0, 1.0)


def flicker(count: int, fps: float, seed: int) -> Iterator[Column]:
    """Yield, for every frame, the factor of the light of each of ``count`` embers by flicker.

    Its logarithm is an autoregressive process in ticks; the mean of the factor is 1.
    """
    chance = generator(seed, RandomStream.FLICKER)
    kept = math.exp(-TICK / _FLICKER_TIME)
    score, tick, frame = chance.standard_normal(count), 0, 0
    while True:
        while tick < round(frame / fps / TICK):
            score = kept * score + math.sqrt(1 - kept**2) * chance.standard_normal(count)
            tick += 1
        yield np.exp(_FLICKER * score - _FLICKER**2 / 2)
        frame += 1
