"""Sparks: thrown once, then slowed by still air and pulled down by gravity. No gas carries them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.emission import Spawns

Column = NDArray[np.float64]

WEIGHT = 0.4
"""Acceleration at which sparks fall, heights/s²."""


@dataclass(frozen=True, slots=True)
class Ballistics:
    """The flight dv/dt = g − drag · v of sparks, solved exactly.

    Attributes:
        spawns: All flakes that are ever spawned.
        weight: Acceleration against which drag holds a spark at its terminal velocity, px/s².
        gravity: The recipe's gravity in addition, px/s².
    """

    spawns: Spawns
    weight: float
    gravity: float

    @classmethod
    def of(cls, spawns: Spawns, height: int, gravity: float) -> "Ballistics":
        """Return the flight of sparks in frames of ``height`` px."""
        return cls(spawns, WEIGHT * height, gravity)

    def at(self, ids: NDArray[np.int64], age: Column) -> tuple[Column, ...]:
        """Return x, y, z (px), vx, vy and vz (px/s) of sparks at an age, s, each (sparks,)."""
        names = "x", "y", "z", "launch_x", "launch_y", "launch_z", "terminal_velocity"
        columns = (getattr(self.spawns, name).take(ids) for name in names)
        x, y, z, launch_x, launch_y, launch_z, terminal = columns
        drag = self.weight / terminal
        fall = (self.weight + self.gravity) / drag
        left, way = np.exp(-drag * age), -np.expm1(-drag * age) / drag
        return (
            x + launch_x * way,
            y + (launch_y - fall) * way + fall * age,
            z + launch_z * way,
            launch_x * left,
            (launch_y - fall) * left + fall,
            launch_z * left,
        )
