"""Intruders (section 6): objects in the flame, as force fields.

No collisions are computed: an intruder pushes the sheets away from its middle line. One that
catches fire carries sheets of its own (``scene.py``). ``intruder_drawing.py`` draws those that are
visible.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.generators.silk.mechanics import Vectors, lengths
from fire_atlas.recipe.silk import Intruder, Shape

Segment = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Both ends (3,) of a line segment, heights."""

_FALLOFF = 0.03
"""Beyond its surface an intruder's force falls to 1/e over its radius plus this, heights."""

_CYLINDERS = ("log", "wax", "wrap")

_SURFACE_ACCELERATION = 12.0
"""Acceleration at the surface of an intruder of strength 1, heights/s²."""


@dataclass(frozen=True, slots=True, eq=False)
class IntruderBody:
    """An intruder: all points within ``radius`` of a line segment that moves along keyframes.

    Each is equal to itself alone.

    Attributes:
        times: (k,) of the keyframes, s, ascending.
        positions: (k, 3) position of its middle, a match's head or a wick's foot at these times,
            heights.
        axis: (3,) vector from there to its far end, heights; zero for a sphere.
        radius: Radius, heights.
        strength: Strength of its force; 1 is about the lift of a flame.
        ignites: Whether it catches fire in a flame.
        visible: Whether it is drawn.
        shape: What it is.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    axis: NDArray[np.float64]
    radius: float
    strength: float
    ignites: bool
    visible: bool
    shape: Shape

    @classmethod
    def of(cls, intruder: Intruder) -> Self:
        """Read an intruder from a recipe."""
        keyframes = [(moment.t, moment.at) for moment in intruder.keyframes]
        if intruder.at is not None:
            keyframes = [(0.0, intruder.at)]
        extent = 0.0 if intruder.shape == "sphere" else intruder.length
        if intruder.shape in _CYLINDERS:
            extent /= 2
        return cls(
            times=np.array([t for t, _ in keyframes]),
            positions=np.array([position for _, position in keyframes]),
            axis=extent * _direction(intruder.angle, intruder.tilt),
            radius=intruder.radius,
            strength=intruder.strength,
            ignites=intruder.catches_fire,
            visible=intruder.draw,
            shape=intruder.shape,
        )

    @property
    def is_match(self) -> bool:
        """Whether it is a match, which chars from its head on."""
        return self.shape == "match"

    @property
    def is_cylinder(self) -> bool:
        """Whether its ends are flat; it extends equally far both ways. Other ends are round."""
        return self.shape in _CYLINDERS

    @property
    def is_rough(self) -> bool:
        """Whether its radius varies over it: a log has furrows, a wrap turns of cloth."""
        return self.shape in ("log", "wrap")

    def position(self, time: float) -> NDArray[np.float64]:
        """Return the position (3,) at ``time`` s, eased in and out between keyframes."""
        if time <= self.times[0]:
            return np.array(self.positions[0])
        if time >= self.times[-1]:
            return np.array(self.positions[-1])
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        share = (time - self.times[k]) / (self.times[k + 1] - self.times[k])
        share = share * share * (3 - 2 * share)
        start, end = self.positions[k : k + 2]
        return np.asarray(start + share * (end - start))

    def ends(self, time: float) -> Segment:
        """Return both ends (3,) of its middle line at ``time`` s, heights."""
        position = self.position(time)
        return (position - self.axis if self.is_cylinder else position), position + self.axis

    def kindling(self, time: float) -> Segment:
        """Return both ends of the part that catches fire: a match's head, a wick's end, else all of
        its middle line."""
        start, end = self.ends(time)
        match self.shape:
            case "match":
                return start, start
            case "wick":
                return end, end
            case _:
                return start, end

    def push(self, time: float, x: Vectors) -> Vectors:
        """Return the force on nodes at ``x`` away from the middle line, for a mass of 1,
        heights/s²."""
        away = x - _nearest_on_segment(self.ends(time), x)
        distance = np.maximum(lengths(away), 1e-6)
        outside = (distance - self.radius) / (self.radius + _FALLOFF)
        strength = self.strength * _SURFACE_ACCELERATION * np.exp(-np.maximum(outside, -1.0))
        return np.asarray(away * (strength / distance)[..., None])


def _direction(angle: float, tilt: float) -> NDArray[np.float64]:
    """Return the unit vector (3,) at ``angle`` seen from above and ``tilt`` upwards, degrees."""
    azimuth, elevation = math.radians(angle), math.radians(tilt)
    level = math.cos(elevation)
    return np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])


def distance_to(segment: Segment, x: Vectors) -> NDArray[np.float64]:
    """Return the distance (...) of each of ``x`` (..., 3) from a line segment."""
    return lengths(x - _nearest_on_segment(segment, x))


def _nearest_on_segment(segment: Segment, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points (..., 3) of a line segment that are nearest to ``x``."""
    start, end = segment
    along = end - start
    square = float((along * along).sum())
    if square == 0:
        return np.broadcast_to(start, x.shape)
    share = np.clip((x - start) @ (along / square), 0.0, 1.0)
    return np.asarray(start + share[..., None] * along)
