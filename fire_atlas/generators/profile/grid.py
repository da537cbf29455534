"""The cells that the detail of a flame is kept in, its sway taken out."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.generators.profile.measure import Measures

_FINEST, _COARSEST = 80, 224
"""Cells a flame is high, at least and at most."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Cells of a straightened flame.

    Attributes:
        up, down: Rows above and below the base.
        side: Columns to either side of the axis.
        per_height, per_half: Cells in a flame's height and in half its foot's width.
    """

    up: int
    down: int
    side: int
    per_height: float
    per_half: float

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.up + self.down, 2 * self.side

    @property
    def heights(self) -> NDArray[np.float64]:
        """(rows,) of the rows' middles above the base, flame heights."""
        return np.asarray((self.up - np.arange(self.up + self.down) - 0.5) / self.per_height)

    @property
    def across(self) -> NDArray[np.float64]:
        """(columns,) of the columns' middles from the axis, half widths."""
        return np.asarray((np.arange(2 * self.side) + 0.5 - self.side) / self.per_half)

    @classmethod
    def around(cls, sides: list[Measures]) -> "Grid":
        """Return the grid that holds the fire of all clips, at about the first one's scale."""
        first = sides[0]
        # Small frames in whole multiples: pixels of a sprite then stay what they are.
        finer = max(1, math.ceil(_FINEST / first.height))
        per_height = min(first.height * finer, _COARSEST)
        per_half = per_height * first.half / first.height
        up = down = side = 0.0
        for each in sides:
            (x, foot), (left, right, top, bottom) = each.base, each.reach
            up = max(up, (foot - top) / each.height)
            down = max(down, (bottom - foot) / each.height)
            side = max(side, max(x - left, right - x) / each.half)
        return cls(
            up=round(per_height * min(up, 2.0)) + 2,
            down=round(per_height * min(down, 0.5)) + 2,
            side=round(per_half * min(side, 8.0)) + 3,
            per_height=per_height,
            per_half=per_half,
        )
