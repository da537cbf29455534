"""The air around a fire: wind, and eddies in it."""

from dataclasses import dataclass

import numpy as np

from fire_atlas.core.pixels import Plane
from fire_atlas.effect.field.eddies import Eddies
from fire_atlas.effect.field.wind import LEVEL_SPEED, wind_velocity
from fire_atlas.recipe.wind import Wind


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
        # What blows away from the camera is not seen.
        right, _ = wind_velocity(self.wind, time)
        return u + np.float32(right * LEVEL_SPEED * self.height), v
