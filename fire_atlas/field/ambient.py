"""The air around a fire: wind, and eddies in it."""

import math
from dataclasses import dataclass

import numpy as np

from fire_atlas.core.pixels import Plane
from fire_atlas.field.eddies import Eddies
from fire_atlas.recipe.wind import Wind

LEVEL = 0.15
"""One level of wind, frame heights per second."""


@dataclass(frozen=True, slots=True)
class Ambient:
    """Air that the fire does not move.

    Attributes:
        eddies: Its small turbulence.
        wind: The recipe's wind.
        height: Frame height, px.
    """

    eddies: Eddies
    wind: Wind
    height: int

    def velocity(self, time: float, shape: tuple[int, int]) -> tuple[Plane, Plane]:
        """u and v, each (rows, columns), px/s, at ``time`` s."""
        u, v = self.eddies.velocity(time, shape)
        return u + np.float32(wind_along_image(self.wind, time) * LEVEL * self.height), v


def wind_along_image(wind: Wind, time: float) -> float:
    """Wind to the right in the image plane at ``time`` s, levels; what blows away is not seen."""
    if wind.keyframes:
        return float(
            np.interp(
                time,
                [k.t for k in wind.keyframes],
                [k.level * math.cos(math.radians(k.direction)) for k in wind.keyframes],
            )
        )
    level = wind.level
    if wind.gusts is not None:
        # Two harmonics, whose highest sum is 1.2147: a gust swells faster than it falls.
        turn = 2 * math.pi * time / wind.gusts.period
        swell = (math.sin(turn) + 0.4 * math.sin(2 * turn)) / 1.2147
        level = max(wind.gusts.mean + wind.gusts.strength * swell, 0.0)
    return level * math.cos(math.radians(wind.direction))
