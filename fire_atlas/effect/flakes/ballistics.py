"""Sparks: thrown once, then slowed by still air and pulled down by gravity. No gas carries them."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Column = NDArray[np.float64]

_GRAVITY = 1.0
"""Acceleration at which sparks fall, heights/s²: a frame shows a few metres."""


@dataclass(frozen=True, slots=True)
class Ballistics:
    """Constants of the flight dv/dt = gravity − drag · v. Columns (flakes,).

    Attributes:
        launch_x, launch_y: Velocity at age 0, px/s.
        drag: Rate at which the air stops each spark, 1/s.
        gravity: Downward acceleration, px/s².
    """

    launch_x: Column
    launch_y: Column
    drag: Column
    gravity: float

    @classmethod
    def of(
        cls, launch_x: Column, launch_y: Column, fall: Column, height: int, gravity: float
    ) -> Self:
        """Return the constants of sparks that fall through still air at ``fall`` px/s.

        ``gravity``, px/s², is that of the recipe, in addition to a spark's weight in a frame of
        ``height`` px.
        """
        weight = _GRAVITY * height
        return cls(launch_x, launch_y, weight / fall, weight + gravity)

    def way(self, which: NDArray[np.int64], age: Column) -> tuple[Column, Column]:
        """Return how far some have flown at an age, s, since they were thrown: x and y, px."""
        drag = self.drag.take(which)
        stopped = -np.expm1(-drag * age) / drag
        fall = self.gravity / drag
        return (
            self.launch_x.take(which) * stopped,
            fall * age + (self.launch_y.take(which) - fall) * stopped,
        )

    def velocity(self, which: NDArray[np.int64], age: Column) -> tuple[Column, Column]:
        """Return the velocity of some at an age, s: x and y, px/s."""
        drag = self.drag.take(which)
        left, fall = np.exp(-drag * age), self.gravity / drag
        return (
            self.launch_x.take(which) * left,
            fall + (self.launch_y.take(which) - fall) * left,
        )
