"""How the recipe's wind blows: its velocity at any moment, and from any side.

Wind is horizontal. A velocity is the pair (right, away) in levels of wind: to the right of the
camera, and away from it; ``LEVEL_SPEED`` makes frame heights per second of a level. Angles are
degrees seen from above, counter-clockwise: 0 blows to the right, 90 away.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

from fire_atlas.recipe.wind import Gusts, Wind, WindKeyframe

LEVEL_SPEED = 0.15
"""Speed of one level of wind, frame heights per second."""

_HARMONIC = 0.4
"""Amplitude of a gust's second harmonic, against its first: it swells faster than it falls."""

_GUST_PEAK, _GUST_PEAK_PHASE = 1.2147, 1.0921
"""Highest sum of the two harmonics, and the phase, radians, at which they reach it."""


def wind_velocity(wind: Wind, time: float) -> tuple[float, float]:
    """Return the velocity (right, away) of the wind at ``time`` s after the first frame, levels."""
    if wind.keyframes:
        return _interpolated(wind.keyframes, time)
    level = wind.level if wind.gusts is None else _gust_level(wind.gusts, time)
    return _components(level, wind.direction)


def peak_level(wind: Wind) -> float:
    """Return the highest level that the wind reaches at any time."""
    if wind.keyframes:
        return max(keyframe.level for keyframe in wind.keyframes)
    return wind.gusts.mean + wind.gusts.strength if wind.gusts else wind.level


def fit_gusts(wind: Wind, duration: float) -> Wind:
    """Return the wind with the nearest gust period of which ``duration`` s hold a whole number.

    The gusts of a loop of that duration then close. Other wind is returned as it is.
    """
    if wind.gusts is None:
        return wind
    period = duration / max(round(duration / wind.gusts.period), 1)
    return wind.model_copy(update={"gusts": wind.gusts.model_copy(update={"period": period})})


def wind_in_view(wind: Wind, azimuth: float) -> Wind:
    """Return the wind in the axes of a camera at ``azimuth`` degrees around the fire.

    The camera has gone counter-clockwise from the front: at 90 it stands to the right of the fire,
    where wind that blows to the right comes towards it.
    """
    keyframes = tuple(
        keyframe.model_copy(update={"direction": keyframe.direction - azimuth})
        for keyframe in wind.keyframes
    )
    rotated = {"direction": wind.direction - azimuth, "keyframes": keyframes}
    return wind.model_copy(update=rotated)


def _gust_level(gusts: Gusts, time: float) -> float:
    """Return the level of gusts at ``time`` s. They begin, and a loop closes, in the lull."""
    # The sum of the harmonics is odd: lowest at minus the phase at which it is highest.
    phase = 2 * math.pi * time / gusts.period - _GUST_PEAK_PHASE
    swell = (math.sin(phase) + _HARMONIC * math.sin(2 * phase)) / _GUST_PEAK
    return max(gusts.mean + gusts.strength * swell, 0.0)


def _components(level: float, direction: float) -> tuple[float, float]:
    """Return the velocity (right, away), levels, of wind that blows to ``direction`` degrees."""
    angle = math.radians(direction)
    return level * math.cos(angle), level * math.sin(angle)


def _interpolated(keyframes: Sequence[WindKeyframe], time: float) -> tuple[float, float]:
    """Return the velocity between keyframes, each component linear in time; before the first and
    after the last, that of the nearest."""
    for before, after in pairwise(keyframes):
        if before.t <= time < after.t:
            share = (time - before.t) / (after.t - before.t)
            right, away = _components(before.level, before.direction)
            to_right, to_away = _components(after.level, after.direction)
            return right + share * (to_right - right), away + share * (to_away - away)
    nearest = keyframes[0] if time < keyframes[0].t else keyframes[-1]
    return _components(nearest.level, nearest.direction)
