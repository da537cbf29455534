"""Particles that rise from the base of the fire to its top (Lee et al., III-C, Figures 9-12)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.easing import smooth_step

_FLAME, _PLUME = 0.2, 1.0
"""Heights where McCaffrey's regimes change, flame heights. Below the first, gas accelerates (speed
as height^1/2), in between its speed is constant, above the second it slows down (height^-1/3)."""

DRAWN_UP_TO = 1.03
"""Height above which particles are not drawn, in heights of the top: there they slow down."""


def height_after(seconds: NDArray[np.floating], rise_speed: float) -> NDArray[np.float64]:
    """Return the height, in flame heights, of a particle ``seconds`` after its birth at the base.

    ``rise_speed`` is that of the intermittent zone (in between), flame heights per second.
    """
    t = np.asarray(seconds, np.float64)
    to_zone, to_plume = 2 * _FLAME / rise_speed, (_PLUME - _FLAME) / rise_speed
    flame = _FLAME * np.square(np.clip(t / to_zone, 0, 1))
    zone = rise_speed * np.clip(t - to_zone, 0, to_plume)
    late = np.maximum(t - to_zone - to_plume, 0)
    plume = (_PLUME ** (4 / 3) + 4 / 3 * rise_speed * _PLUME ** (1 / 3) * late) ** 0.75 - _PLUME
    return np.asarray(flame + zone + plume, np.float64)


def rise_time(height: float, rise_speed: float) -> float:
    """Return the seconds a particle takes from the base to ``height``."""
    to_plume = (2 * _FLAME + _PLUME - _FLAME) / rise_speed
    if height <= _PLUME:
        return to_plume * height / _PLUME
    late = (height ** (4 / 3) - _PLUME ** (4 / 3)) * 0.75 / (rise_speed * _PLUME ** (1 / 3))
    return float(to_plume + late)


@dataclass(frozen=True, slots=True)
class PeripheralCurve:
    """The outline of the base seen from above: a closed cubic spline through the extreme points of
    both views (Figure 12).

    Attributes:
        front: Half width seen from the front (azimuth 0), along x.
        side: Half width seen from the side, along z, the line of sight of the front.
    """

    front: float
    side: float

    def at(self, azimuths: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return its x and z (n,) at ``azimuths`` (n,), radians."""
        quarters = azimuths / (math.pi / 2)
        return self.front * _wave(quarters), self.side * _wave(quarters - 1)

    def half_width(self, azimuth: float) -> float:
        """Return half its width seen from ``azimuth``, radians."""
        x, z = self.at(np.linspace(0, 2 * math.pi, 361))
        return float((x * math.cos(azimuth) + z * math.sin(azimuth)).max())


def _wave(quarters: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the closed cubic spline that is 1, 0, -1 and 0 after whole ``quarters`` (n,) of a
    turn."""
    zigzag = np.abs(np.mod(quarters, 4) - 2) - 1
    return np.asarray(zigzag * (3 - zigzag * zigzag) / 2, np.float64)


@dataclass(frozen=True, slots=True)
class Particles:
    """All particles of a fire; each is born once in every period.

    Attributes:
        birth: (n,) time of birth in the period, frames.
        slice: (n,) index of the vertical slice in which each rises.
        x, z: (n,) place of birth to the right of the axis and behind it, half widths of the front.
        size: (n,) relative to the typical size.
        lifetime: Frames for which each lives; in a short loop, longer than the period.
        period: Frames after which the fire repeats.
    """

    birth: NDArray[np.float64]
    slice: NDArray[np.intp]
    x: NDArray[np.float64]
    z: NDArray[np.float64]
    size: NDArray[np.float64]
    lifetime: int
    period: int

    @classmethod
    def random(
        cls, seed: int, azimuths: NDArray[np.float64], alive: int, rising: float, lifetime: int,
        period: int, curve: PeripheralCurve,
    ) -> "Particles":  # fmt: skip
        """Spawn particles at random, evenly over the period.

        Args:
            seed: Seed of the recipe.
            azimuths: (slices,) directions of the vertical slices, radians.
            alive: Number of particles in a slice at any time, below ``DRAWN_UP_TO``.
            rising: Frames that one takes to there.
            lifetime, period: See the class.
            curve: Outline of the base.
        """
        parts = []
        number = max(1, round(alive * period / rising))
        for k, azimuth in enumerate(azimuths):
            chance = generator(seed, RandomStream.PARTICLES, k)
            birth = (np.arange(number) + chance.random(number)) * period / number
            distance = chance.uniform(-1, 1, number)
            direction = np.where(distance < 0, azimuth + math.pi, azimuth)
            x, z = (place * np.abs(distance) for place in curve.at(direction))
            size = np.exp(chance.normal(0, 0.2, number))
            parts.append((birth, np.full(number, k), x, z, size))
        birth, slice_, x, z, size = (np.concatenate(part) for part in zip(*parts, strict=True))
        return cls(birth, slice_, x, z, size, lifetime, period)

    def alive(self, time: float) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the indices of the particles alive at ``time``, and their ages in frames."""
        age = np.mod(time - self.birth, self.period)
        # In a loop shorter than a life, some were born in rounds before.
        loops_ago = np.arange(-(-self.lifetime // self.period))
        ages = np.asarray(age + self.period * loops_ago[:, None], np.float64)
        which, alive = np.nonzero(ages < self.lifetime)
        return alive, ages[which, alive]


def opacity(age: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the opacity of particles of an ``age`` (0..1 of their life): they fade in and out."""
    return smooth_step(age / 0.3) * smooth_step((1 - age) / 0.45)
