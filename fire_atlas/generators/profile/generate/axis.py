"""The axis of a fire that leans: a curve in space that every camera sees in its own way.

The fire leans as one body. Its axis is vertical at the base, bends to one side up to the height of
the flame, and is straight above; its length stays. A slender fire lies square to it, so that what
rises in it turns with it. The tongues of a wide fire lean each on its own: its rows stay level.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane

_BEND = 1.5
"""Angle of the axis at the height of the flame, and above, relative to the lean of the line from
the base to there: the angle grows as 2h − h²."""

_STEP = 1 / 32
"""Distance of nodes along the axis, flame heights."""

_SLENDER, _WIDE = 0.4, 0.9
"""Half widths, flame heights, up to which a fire lies square to its axis, and from which its rows
stay level. On the inner side of the bend, rows do not cross that far from the axis."""

_LEAST_SPEED = 0.2
"""Least length of a flame height of the axis as a camera sees it that places are divided by."""

_CELL = 4
"""Side of the square of px in which places along the axis change evenly."""

_ITERATIONS = 4
"""Steps of Newton's method."""

Places = NDArray[np.float64]


@dataclass(frozen=True)
class BentAxis:
    """The axis of a fire in one frame, as one camera sees it. Lengths are flame heights.

    Attributes:
        heights: (n,) length of the axis from the base to each node; negative below it.
        right: (n,) how far each is to the right in the picture.
        up: (n,) how far each is up in the picture, as a camera that looks down sees it.
        away: (n,) how far the middle of the fire is away from a level camera there.
        turn: (n,) angle to which the fire turns there in the picture, to the right, radians.
        speed: (n,) length of the axis in the picture, per length of the axis.
    """

    heights: Places
    right: Places
    up: Places
    away: Places
    turn: Places
    speed: Places

    @classmethod
    def of(
        cls,
        lean: tuple[float, float],
        elevation: float,
        span: tuple[float, float],
        widest: float,
        behind: Callable[[Places], Places] | None = None,
    ) -> "BentAxis":
        """Return the axis of a fire.

        Args:
            lean: Lean to the right of the camera and away from it, radians.
            elevation: Of the camera, radians.
            span: Heights of the lowest and the highest node.
            widest: Half the greatest width of the fire, flame heights.
            behind: How far the fire's middle is behind its bent axis, by height; None for not.
        """
        angle = math.hypot(*lean)
        first = math.floor(span[0] / _STEP)
        nodes = range(first, math.ceil(span[1] / _STEP) + 1)
        heights = np.array([node * _STEP for node in nodes], np.float64)
        h = np.clip(heights, 0.0, 1.0)
        tilt = _BEND * angle * h * (2 - h)
        across, up = (_integrated(np.asarray(f(tilt)), -first) for f in (np.sin, np.cos))
        right, away = (
            np.asarray(across * (part / angle if angle else 0.0), np.float64) for part in lean
        )
        if behind is not None:
            away = np.asarray(away + behind(heights), np.float64)
        seen = np.asarray(up * math.cos(elevation) + away * math.sin(elevation), np.float64)
        to_right, to_up = np.gradient(right, _STEP), np.gradient(seen, _STEP)
        turn = np.arctan2(to_right, np.maximum(to_up, 1e-9)).astype(np.float64)
        turn *= float(np.clip((_WIDE - widest) / (_WIDE - _SLENDER), 0, 1))
        speed = np.maximum(np.hypot(to_right, to_up), _LEAST_SPEED).astype(np.float64)
        return cls(heights, right, seen, away, turn, speed)

    @cached_property
    def is_straight(self) -> bool:
        """Whether the fire does not lean."""
        return not self.right.any() and not self.away.any()

    def at(self, values: Places, heights: NDArray[np.floating]) -> Places:
        """Return ``values`` (n,) of the nodes at ``heights``, continued evenly beyond the ends."""
        place = np.clip((heights - self.heights[0]) / _STEP, 0, len(values) - 1)
        beyond = (heights - self.heights[0]) / _STEP - place
        lower = np.minimum(place.astype(np.intp), len(values) - 2)
        change = np.diff(values)[lower]
        return np.asarray(values[lower] + change * (place - lower + beyond), np.float64)

    def placed(
        self, heights: NDArray[np.floating], across: NDArray[np.floating]
    ) -> tuple[Places, Places]:
        """Return where in the picture, to the right and up, places of the fire are: at ``heights``
        along its axis, and ``across`` to the right of it."""
        turn = self.at(self.turn, heights)
        right = self.at(self.right, heights) + across * np.cos(turn)
        return right, self.at(self.up, heights) - across * np.sin(turn)

    def straightened(
        self, right: NDArray[np.floating], up: NDArray[np.floating]
    ) -> tuple[Places, Places]:
        """Return the height along the axis, and the distance to the right of it, of places in the
        picture: the inverse of ``placed``, by Newton's method."""
        slope = max(float(self.speed[0]), _LEAST_SPEED)
        if self.is_straight:
            heights, across = np.broadcast_arrays(up / slope, right)
            return heights.astype(np.float64), across.astype(np.float64)
        rising = np.maximum.accumulate(self.up)
        heights = np.interp(up, rising, self.heights, right=np.nan)
        beyond = self.heights[-1] + (up - rising[-1]) / slope
        heights = np.where(np.isnan(heights), beyond, heights)
        turning = np.gradient(self.turn, _STEP)
        to_right, to_up = np.gradient(self.right, _STEP), np.gradient(self.up, _STEP)
        across = np.zeros_like(heights)
        for step in range(_ITERATIONS + 1):
            turn = self.at(self.turn, heights)
            cos, sin = np.cos(turn), np.sin(turn)
            x = right - self.at(self.right, heights)
            y = up - self.at(self.up, heights)
            across = x * cos - y * sin
            if step < _ITERATIONS:
                along = self.at(to_right, heights) * sin + self.at(to_up, heights) * cos
                slower = np.maximum(along - across * self.at(turning, heights), _LEAST_SPEED)
                heights = heights + np.clip((x * sin + y * cos) / slower, -0.5, 0.5)
        return heights, across

    def straightened_frame(
        self, right: NDArray[np.floating], up: NDArray[np.floating]
    ) -> tuple[Places, Places]:
        """Return the same for all pixels of a frame whose columns are at ``right`` (columns,) and
        whose rows at ``up`` (rows,), evenly spaced: (rows, columns) each.

        It is computed for every fourth pixel, because it changes slowly.
        """
        if self.is_straight:
            return self.straightened(right[None, :], up[:, None])
        x, y = (_coarse(axis) for axis in (right, up))
        size = len(x) * _CELL, len(y) * _CELL
        inner = slice(_CELL, _CELL + len(up)), slice(_CELL, _CELL + len(right))
        heights, across = (
            cv2.resize(as_plane(plane), size, interpolation=cv2.INTER_LINEAR)[inner]
            for plane in self.straightened(x[None, :], y[:, None])
        )
        return heights.astype(np.float64), across.astype(np.float64)


def _integrated(slope: Places, zero: int) -> Places:
    """Return the integral of a ``slope`` (n,) along the axis, by trapezoids, 0 at node ``zero``."""
    total = np.append(0.0, np.cumsum((slope[1:] + slope[:-1]) * (_STEP / 2)))
    return np.asarray(total - total[zero], np.float64)


def _coarse(axis: NDArray[np.floating]) -> Places:
    """Return the middles of squares of px, one more at each end, of places that are evenly spaced
    along an axis of the frame."""
    cells = -(-len(axis) // _CELL) + 2
    step = float(axis[1] - axis[0]) if len(axis) > 1 else 1.0
    first = float(axis[0]) + step * ((_CELL - 1) / 2 - _CELL)
    return np.asarray(first + step * _CELL * np.arange(cells), np.float64)
