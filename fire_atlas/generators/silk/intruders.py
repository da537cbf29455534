"""Things in the flame: fields of force that push it aside (section 6: no collisions are sought)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.generators.silk.mesh import Vectors, length

_REACH = 0.03
"""How much further than its own radius beyond its surface an intruder is felt (to 1/e), heights."""

PUSH = 12.0
"""Acceleration at the surface of an intruder of strength 1, heights/s²."""


@dataclass(frozen=True, slots=True)
class Body:
    """An intruder: all that is within ``radius`` of a straight piece.

    Attributes:
        times: (k,) s, ascending.
        places: (k, 3) where its middle (of a match: its head) is then, heights.
        axis: (3,) from there to its far end, heights; zero for a sphere.
        centred: Whether it stretches as far to the other side.
        radius: heights.
        strength: Against the lift of a flame.
        shown: Whether it is drawn.
        is_match: Whether it catches fire at its head.
    """

    times: NDArray[np.float64]
    places: NDArray[np.float64]
    axis: NDArray[np.float64]
    centred: bool
    radius: float
    strength: float
    shown: bool
    is_match: bool

    def at(self, time: float) -> NDArray[np.float64]:
        """Place (3,) at ``time`` s: between moments it starts and stops gently."""
        if time <= self.times[0]:
            return np.array(self.places[0])
        if time >= self.times[-1]:
            return np.array(self.places[-1])
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        share = (time - self.times[k]) / (self.times[k + 1] - self.times[k])
        share = share * share * (3 - 2 * share)
        return np.asarray(self.places[k] + share * (self.places[k + 1] - self.places[k]))

    def ends(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Both ends (3,) of its middle line, heights."""
        place = self.at(time)
        return (place - self.axis if self.centred else place), place + self.axis

    def push(self, time: float, x: Vectors) -> Vectors:
        """Acceleration of every node away from the middle line, heights/s²."""
        one, other = self.ends(time)
        away = x - nearest_on_piece(one, other, x)
        distance = np.maximum(length(away), 1e-6)
        outside = (distance - self.radius) / (self.radius + _REACH)
        strength = self.strength * PUSH * np.exp(-np.maximum(outside, -1.0))
        return np.asarray(away * (strength / distance)[..., None])


def nearest_on_piece(
    one: NDArray[np.float64], other: NDArray[np.float64], x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The places (..., 3) on the straight piece between two points that are nearest to ``x``."""
    along = other - one
    square = float((along * along).sum())
    if square == 0:
        return np.broadcast_to(one, x.shape)
    share = np.clip(np.einsum("...d,d->...", x - one, along) / square, 0.0, 1.0)
    return np.asarray(one + share[..., None] * along)


def stretched(half: float, angle: float, tilt: float) -> NDArray[np.float64]:
    """Axis (3,) of ``half`` a length, in a direction of ``angle`` and ``tilt`` degrees."""
    turned, raised = math.radians(angle), math.radians(tilt)
    flat = math.cos(raised)
    return half * np.array([flat * math.cos(turned), flat * math.sin(turned), math.sin(raised)])
