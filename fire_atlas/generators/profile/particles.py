"""Particles: born on the base, flown to the top (Lee et al., III-C, Figures 9-12)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.chance import Stage, generator
from fire_atlas.core.easing import smooth_step

FLAME, PLUME = 0.2, 1.0
"""Heights at which McCaffrey's regimes change, flame heights: below, burning gases accelerate (as
the root of height), between, they rise at a constant speed, above they slow down (height^-1/3)."""


def height_after(seconds: NDArray[np.floating], rise: float) -> NDArray[np.float64]:
    """Height, in flame heights, of what was born at the base ``seconds`` ago.

    ``rise`` is the speed in the intermittent zone, heights per second. Integrated in closed form.
    """
    t = np.asarray(seconds, np.float64)
    to_zone, to_plume = 2 * FLAME / rise, (PLUME - FLAME) / rise
    flame = FLAME * np.square(np.clip(t / to_zone, 0, 1))
    zone = rise * np.clip(t - to_zone, 0, to_plume)
    late = np.maximum(t - to_zone - to_plume, 0)
    plume = (PLUME ** (4 / 3) + 4 / 3 * rise * PLUME ** (1 / 3) * late) ** 0.75 - PLUME
    return np.asarray(flame + zone + plume, np.float64)


def time_to(height: float, rise: float) -> float:
    """Seconds after which what was born at the base is at ``height``."""
    to_plume = (2 * FLAME + PLUME - FLAME) / rise
    if height <= PLUME:
        return to_plume * height / PLUME
    late = (height ** (4 / 3) - PLUME ** (4 / 3)) * 0.75 / (rise * PLUME ** (1 / 3))
    return float(to_plume + late)


def peripheral_curve(front: float, side: float) -> CubicSpline:
    """Closed cubic spline through the extreme points of both views, seen from above (Figure 12).

    Args:
        front: Half width seen from the front (azimuth 0), along x.
        side: Half width seen from the side, along the view of the front.

    Returns:
        (x, z) by azimuth, radians.
    """
    turn = np.linspace(0, 2 * math.pi, 5)
    ends = np.array([(front, 0), (0, side), (-front, 0), (0, -side), (front, 0)])
    return CubicSpline(turn, ends, bc_type="periodic")


def half_width(curve: CubicSpline, azimuth: float) -> float:
    """Half the width of the closed ``curve`` for a camera at ``azimuth``, radians."""
    x, z = curve(np.linspace(0, 2 * math.pi, 361)).T
    return float((x * math.cos(azimuth) + z * math.sin(azimuth)).max())


@dataclass(frozen=True, slots=True)
class Particles:
    """All particles of a fire; each lives once every period.

    Attributes:
        born: (n,) frame of birth, in the period.
        slice: (n,) which slice each flies in.
        x, z: (n,) where on the base each is born, half widths of the front: right, and away.
        size: (n,) relative to the others.
        life: Frames each lives.
        period: Frames after which all begins anew.
    """

    born: NDArray[np.float64]
    slice: NDArray[np.intp]
    x: NDArray[np.float64]
    z: NDArray[np.float64]
    size: NDArray[np.float64]
    life: int
    period: int

    @classmethod
    def random(
        cls, seed: int, planes: NDArray[np.float64], alive: int, life: int, period: int,
        curve: CubicSpline,
    ) -> "Particles":  # fmt: skip
        """Let ``alive`` particles live at a time in each slice.

        Args:
            seed: Of the recipe.
            planes: (slices,) azimuth of each slice, radians.
            alive: Particles of a slice alive at a time.
            life, period: As of the class.
            curve: The base's outline.
        """
        parts = []
        number = max(1, round(alive * period / life))
        for k, plane in enumerate(planes):
            chance = generator(seed, Stage.PARTICLES, k)
            born = (np.arange(number) + chance.random(number)) * period / number
            along = chance.uniform(-1, 1, number)
            azimuth = np.where(along < 0, plane + math.pi, plane)
            places = curve(np.mod(azimuth, 2 * math.pi)) * np.abs(along)[:, None]
            size = np.exp(chance.normal(0, 0.2, number))
            parts.append((born, np.full(number, k), *places.T, size))
        born, flies, x, z, size = (np.concatenate(part) for part in zip(*parts, strict=True))
        return cls(born, flies, x, z, size, life, period)

    def alive(self, time: float) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the numbers of those alive at a time, and their ages, in frames."""
        age = np.mod(time - self.born, self.period)
        living = np.flatnonzero(age < self.life)
        return living, age[living]


def opacity(age: NDArray[np.float64]) -> NDArray[np.float64]:
    """Opacity of a particle through its life (age 0..1): it comes and goes softly."""
    return smooth_step(age / 0.3) * smooth_step((1 - age) / 0.45)
