"""Wind of the recipe: its velocity at any moment, seen from any side, and the ambient flow.

Wind is horizontal. A velocity is the pair (right, away) in wind levels: towards the camera's right,
and away from it; ``LEVEL_SPEED`` converts it to frame heights per second. Angles are degrees,
counter-clockwise seen from above: wind of 0° blows to the right, of 90° away from the camera.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Plane
from fire_atlas.effect.field.eddies import Eddies
from fire_atlas.effect.field.forcing import grid_shape
from fire_atlas.recipe.effect import Buoyancy
from fire_atlas.recipe.wind import Gusts, Wind, WindKeyframe

LEVEL_SPEED = 0.15
"""Speed of one level of wind, frame heights per second."""

_HARMONIC = 0.4
"""Amplitude of a gust's second harmonic relative to its first: gusts rise faster than they fall."""

_GUST_PEAK, _GUST_PEAK_PHASE = 1.2147, 1.0921
"""Maximum of sin φ + 0.4 sin 2φ, the sum of the harmonics, and its φ, radians."""


@dataclass(frozen=True, slots=True)
class AmbientFlow:
    """Motion of the air around a fire that the fire does not cause: wind and turbulence.

    Attributes:
        eddies: The turbulence.
        wind: The recipe's wind.
        height: Frame height, px.
    """

    eddies: Eddies
    wind: Wind
    height: int

    @classmethod
    def of(cls, wind: Wind, buoyancy: Buoyancy, clip: Clip, seed: int, view: int = 0) -> Self:
        """Return the ambient flow of a clip; turbulence and gusts of a loop repeat with it.

        Each ``view`` has eddies of its own.
        """
        rows, columns = grid_shape(clip.width, clip.height, buoyancy.cell)
        period = clip.count / clip.fps if clip.loop else None
        wind = wind if period is None else fit_gusts(wind, period)
        repeating = columns if clip.tiles else None
        speed = buoyancy.turbulence * clip.height
        eddies = Eddies.random(seed, rows, speed, period, view, repeating)
        return cls(eddies, wind, clip.height)

    def velocity(self, time: float, shape: tuple[int, int]) -> tuple[Plane, Plane]:
        """Return u and v, each (rows, columns), px/s, at ``time`` s."""
        u, v = self.eddies.velocity(time, shape)
        # The picture does not show motion away from the camera.
        right, _ = wind_velocity(self.wind, time)
        return u + np.float32(right * LEVEL_SPEED * self.height), v


def wind_velocity(wind: Wind, time: float) -> tuple[float, float]:
    """Return the velocity (right, away) of the wind at ``time`` s after the first frame, levels."""
    if wind.keyframes:
        return _interpolated(wind.keyframes, time)
    level = wind.level if wind.gusts is None else _gust_level(wind.gusts, time)
    return _components(level, wind.direction)


def fit_gusts(wind: Wind, duration: float) -> Wind:
    """Return the wind, its gust period adjusted to fit into ``duration`` s a whole number of times.

    The gusts of a loop of that duration then close. Wind without gusts is returned as it is.
    """
    if wind.gusts is None:
        return wind
    period = duration / max(round(duration / wind.gusts.period), 1)
    return wind.model_copy(update={"gusts": wind.gusts.model_copy(update={"period": period})})


def wind_in_view(wind: Wind, azimuth: float) -> Wind:
    """Return the wind in the axes of a camera at ``azimuth`` degrees around the fire.

    The azimuth grows counter-clockwise from the front: at 90 the camera stands to the right of the
    fire, and wind that blows to the right comes towards it.
    """
    keyframes = tuple(
        keyframe.model_copy(update={"direction": keyframe.direction - azimuth})
        for keyframe in wind.keyframes
    )
    rotated = {"direction": wind.direction - azimuth, "keyframes": keyframes}
    return wind.model_copy(update=rotated)


def _gust_level(gusts: Gusts, time: float) -> float:
    """Return the level of gusts at ``time`` s; at time 0 they are at their weakest."""
    # The sum of the harmonics is an odd function: its minimum is at minus the phase of its maximum.
    phase = 2 * math.pi * time / gusts.period - _GUST_PEAK_PHASE
    swell = (math.sin(phase) + _HARMONIC * math.sin(2 * phase)) / _GUST_PEAK
    return max(gusts.mean + gusts.strength * swell, 0.0)


def _components(level: float, direction: float) -> tuple[float, float]:
    """Return the velocity (right, away), levels, of wind that blows to ``direction`` degrees."""
    angle = math.radians(direction)
    return level * math.cos(angle), level * math.sin(angle)


def _interpolated(keyframes: Sequence[WindKeyframe], time: float) -> tuple[float, float]:
    """Return the velocity at ``time`` s: linear between keyframes, that of the nearest outside."""
    for before, after in pairwise(keyframes):
        if before.t <= time < after.t:
            fraction = (time - before.t) / (after.t - before.t)
            right, away = _components(before.level, before.direction)
            to_right, to_away = _components(after.level, after.direction)
            return right + fraction * (to_right - right), away + fraction * (to_away - away)
    nearest = keyframes[0] if time < keyframes[0].t else keyframes[-1]
    return _components(nearest.level, nearest.direction)
