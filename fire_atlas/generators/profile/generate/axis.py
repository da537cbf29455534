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
stay level."""

_LEAST_RISE = 0.15
"""Least height in the picture of a flame height of the axis: where it leans so far towards a camera
that looks down that it would end lower than it began, it is seen nearly along itself instead."""

_MAX_CELL, _CELLS = 4, 24
"""Largest side of the square of px in which places along the axis change evenly, and number of such
squares that a frame has at least to each side."""

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
    """

    heights: Places
    right: Places
    up: Places
    away: Places
    turn: Places

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
        rises = np.maximum(np.gradient(seen, _STEP), _LEAST_RISE)
        seen = _integrated(rises, -first) + seen[-first]
        turn = np.arctan2(np.gradient(right, _STEP), rises).astype(np.float64)
        turn *= float(np.clip((_WIDE - widest) / (_WIDE - _SLENDER), 0, 1))
        return cls(heights, right, seen, away, turn)

    @cached_property
    def is_straight(self) -> bool:
        """Whether the camera sees it upright and evenly long."""
        return not self.right.any() and bool(np.ptp(np.diff(self.up)) < 1e-9)

    @cached_property
    def tangent(self) -> tuple[Places, Places]:
        """How far to the right and up (n,) each goes in the picture per length of the axis."""
        to_right, to_up = (np.gradient(coordinate, _STEP) for coordinate in (self.right, self.up))
        return np.asarray(to_right, np.float64), np.asarray(to_up, np.float64)

    def at(self, values: Places, heights: NDArray[np.floating]) -> Places:
        """Return ``values`` (n,) of the nodes at ``heights``; they are constant beyond the ends."""
        return np.asarray(np.interp(heights, self.heights, values), np.float64)

    def continued(self, values: Places, heights: NDArray[np.floating]) -> Places:
        """Return places, ``values`` (n,) of the nodes, at ``heights``; they go on evenly beyond the
        ends."""
        found = self.at(values, heights)
        low, high = heights - self.heights[0], heights - self.heights[-1]
        if np.min(low) < 0:
            found += np.minimum(low, 0) * ((values[1] - values[0]) / _STEP)
        if np.max(high) > 0:
            found += np.maximum(high, 0) * ((values[-1] - values[-2]) / _STEP)
        return found

    def placed(
        self, heights: NDArray[np.floating], across: NDArray[np.floating]
    ) -> tuple[Places, Places]:
        """Return where in the picture, to the right and up, places of the fire are: at ``heights``
        along its axis, and ``across`` to the right of it."""
        turn = self.at(self.turn, heights)
        right = self.continued(self.right, heights) + across * np.cos(turn)
        return right, self.continued(self.up, heights) - across * np.sin(turn)

    def straightened(
        self, right: NDArray[np.floating], up: NDArray[np.floating]
    ) -> tuple[Places, Places]:
        """Return the height along the axis, and the distance to the right of it, of places in the
        picture: the inverse of ``placed``, by Newton's method."""
        to_right, to_up = self.tangent
        if self.is_straight:
            heights = np.asarray(up / to_up[0], np.float64)
            return heights, np.asarray(right, np.float64)
        heights = np.interp(up, self.up, self.heights)
        heights += np.maximum(up - self.up[-1], 0) / to_up[-1]
        heights += np.minimum(up - self.up[0], 0) / to_up[0]
        turning = np.gradient(self.turn, _STEP)
        across = np.zeros_like(heights)
        for step in range(_ITERATIONS + 1):
            turn = self.at(self.turn, heights)
            cos, sin = np.cos(turn), np.sin(turn)
            x = right - self.continued(self.right, heights)
            y = up - self.continued(self.up, heights)
            across = x * cos - y * sin
            if step < _ITERATIONS:
                along = self.at(to_right, heights) * sin + self.at(to_up, heights) * cos
                slower = np.maximum(along - across * self.at(turning, heights), _LEAST_RISE)
                heights = heights + np.clip((x * sin + y * cos) / slower, -0.5, 0.5)
        return heights, across

    def frame_places(self, right: NDArray[np.floating], up: NDArray[np.floating]) -> "FramePlaces":
        """Return the same for the pixels of a frame whose columns are at ``right`` (columns,) and
        whose rows at ``up`` (rows,), evenly spaced."""
        size = len(up), len(right)
        if self.is_straight:
            return FramePlaces(*self.straightened(right[None, :], up[:, None]), size, 1)
        cell = max(1, min(_MAX_CELL, min(size) // _CELLS))
        x, y = (_coarse(axis, cell) for axis in (right, up))
        return FramePlaces(*self.straightened(x[None, :], y[:, None]), size, cell)


@dataclass(frozen=True, slots=True)
class FramePlaces:
    """Where in a fire the pixels of a frame lie, at fewer places than that: they change slowly.

    Attributes:
        heights: Height along the axis, flame heights.
        across: Distance to the right of it, flame heights; of a shape that goes with ``heights``.
        size: Rows and columns of the frame.
        cell: Side of the square of px that each place stands for.
    """

    heights: Places
    across: Places
    size: tuple[int, int]
    cell: int

    def full(self, values: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return values at the places, (...) as ``heights`` or ``across``, for all pixels (rows,
        columns)."""
        rows, columns = self.size
        if self.cell == 1 and self.heights.shape != self.across.shape:
            return as_plane(np.broadcast_to(values, self.size))
        plane = as_plane(np.broadcast_to(values, self.heights.shape))
        size = plane.shape[1] * self.cell, plane.shape[0] * self.cell
        large = cv2.resize(plane, size, interpolation=cv2.INTER_LINEAR)
        return as_plane(large[self.cell : self.cell + rows, self.cell : self.cell + columns])


def _integrated(slope: Places, zero: int) -> Places:
    """Return the integral of a ``slope`` (n,) along the axis, by trapezoids, 0 at node ``zero``."""
    total = np.append(0.0, np.cumsum((slope[1:] + slope[:-1]) * (_STEP / 2)))
    return np.asarray(total - total[zero], np.float64)


def _coarse(axis: NDArray[np.floating], cell: int) -> Places:
    """Return the middles of cells of px, one more at each end, of places that are evenly spaced
    along an axis of the frame."""
    cells = -(-len(axis) // cell) + 2
    step = float(axis[1] - axis[0]) if len(axis) > 1 else 1.0
    first = float(axis[0]) + step * ((cell - 1) / 2 - cell)
    return np.asarray(first + step * cell * np.arange(cells), np.float64)
