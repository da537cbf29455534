"""External forces on the sheets: wind, slow sway, lift by heat, gravity and flutter."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.effect.field.wind import LEVEL_SPEED, wind_velocity
from fire_atlas.generators.silk.fuel import Fuel
from fire_atlas.generators.silk.mechanics import Vectors, normals
from fire_atlas.recipe.wind import Wind

_WAVES = 7
"""Number of waves summed for the flutter of each sheet, and for the sway."""

_GUST_GAIN = 0.5
"""Increase of flutter and sway per level of wind, relative to still air."""

_MIN_FLUTTER = 0.6
"""Minimum frequency of the flutter, Hz."""

_BOUNDARY_LAYER = 0.12
"""Height above the ground at which the wind has half its speed, heights."""


@dataclass(frozen=True, slots=True)
class SheetForces:
    """All forces on the sheets other than their springs and the intruders.

    Attributes:
        fuel: The fuel.
        wind: The recipe's wind.
        gravity: Acceleration downwards, heights/s².
        lift: Acceleration upwards by heat at the base, heights/s².
        lift_decay: (sheets, 1, 1) distance above the base where lift falls to 1/e, heights.
        base: (sheets, 1, 1) z of the base of each sheet, heights.
        row_phase: (sheets, rows, waves) phase of the flutter by row, rad.
        column_phase: (sheets, columns, waves) phase added by column, rad.
        flutter_frequency: (sheets, waves) angular frequency, rad/s.
        sway: (3, waves) phase (rad), frequency (rad/s) and heading (rad) of the sway.
        flutter: Acceleration (rms) at the top of a sheet in still air, heights/s².
    """

    fuel: Fuel
    wind: Wind
    gravity: float
    lift: float
    lift_decay: NDArray[np.float64]
    base: NDArray[np.float64]
    row_phase: NDArray[np.float64]
    column_phase: NDArray[np.float64]
    flutter_frequency: NDArray[np.float64]
    sway: NDArray[np.float64]
    flutter: float

    @classmethod
    def of(
        cls, rest: Vectors, fuel: Fuel, wind: Wind, seed: int, factors: tuple[float, float, float]
    ) -> Self:
        """Return the forces on sheets whose nodes rest at ``rest``.

        ``factors`` are multiples of the fuel's lift, gravity and turbulence.
        """
        sheets, rows, columns = rest.shape[:3]
        height = rest[:, -1, 0, 2] - rest[:, 0, 0, 2]
        size = (sheets, 1, _WAVES)
        chance = generator(seed, RandomStream.TURBULENCE)
        # Each wave has 0.4 to 1.6 periods over the height and rises at 0.7 of the gas speed.
        up = chance.uniform(0.4, 1.6, size)
        across = chance.uniform(-0.7, 0.7, size)
        phase = chance.uniform(0, 2 * np.pi, size)
        hertz = up[:, 0] * fuel.gas_speed * 0.7 + chance.normal(0, 0.2, size)[:, 0]
        share = np.linspace(0, 1, rows)[None, :, None]
        along = np.linspace(-0.5, 0.5, columns)[None, :, None]
        lift, gravity, turbulence = factors
        column = (slice(None), None, None)
        return cls(
            fuel=fuel,
            wind=wind,
            gravity=fuel.gravity * gravity,
            lift=fuel.lift * lift,
            lift_decay=(fuel.lift_height * height)[column],
            base=rest[:, 0, 0, 2][column],
            row_phase=2 * np.pi * up * share + phase,
            column_phase=2 * np.pi * across * along,
            # A minimum, because a wave at rest would bend its sheet to one side all the time.
            flutter_frequency=2 * np.pi * np.maximum(hertz, _MIN_FLUTTER),
            sway=_random_sway(chance),
            flutter=fuel.flutter * turbulence,
        )

    def air_velocity(self, time: float, x: Vectors) -> Vectors:
        """Return the air's velocity at every node, heights/s: wind and sway, growing upwards."""
        right, away = wind_velocity(self.wind, time)
        gust = 1 + _GUST_GAIN * np.hypot(right, away)
        above = np.maximum(x[..., 2], 0.0)
        profile = above / (above + _BOUNDARY_LAYER)
        phase, frequency, heading = self.sway
        # Waves travel upwards (0.35 s per height), so the top follows the base.
        delay = frequency * 0.35
        sway = np.sin(phase + frequency * time - delay * above[..., None])
        sway *= self.fuel.sway * gust * np.sqrt(2 / len(phase))
        u = np.zeros_like(x)
        for axis, wind, part in ((0, right, np.cos(heading)), (1, away, np.sin(heading))):
            u[..., axis] = profile * (wind * LEVEL_SPEED + np.einsum("srcw,w->src", sway, part))
        return u

    def acceleration(self, time: float, x: Vectors, v: Vectors) -> Vectors:
        """Return the acceleration of every node, heights/s²."""
        a = (self.air_velocity(time, x) - v) * self.fuel.drag
        risen = np.maximum(x[..., 2] - self.base, 0.0)
        a[..., 2] += self.lift * np.exp(-risen / self.lift_decay) - self.gravity
        return a + self._flutter(time) * normals(x)

    def _flutter(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration (sheets, rows, columns, 1) along the normals, heights/s²."""
        gust = 1 + _GUST_GAIN * float(np.hypot(*wind_velocity(self.wind, time)))
        rows = self.row_phase - (self.flutter_frequency * time)[:, None]
        waves = np.einsum("srw,scw->src", np.sin(rows), np.cos(self.column_phase))
        waves += np.einsum("srw,scw->src", np.cos(rows), np.sin(self.column_phase))
        share = np.linspace(0, 1, rows.shape[1])[None, :, None]
        waves *= share * (self.flutter * gust * math.sqrt(2 / _WAVES))
        return np.asarray(waves[..., None])


def _random_sway(chance: np.random.Generator) -> NDArray[np.float64]:
    """Return (3, waves): phase, angular frequency (0.25 to 1.6 Hz) and heading of each wave."""
    return np.stack([
        chance.uniform(0, 2 * np.pi, _WAVES),
        2 * np.pi * np.exp(chance.uniform(np.log(0.25), np.log(1.6), _WAVES)),
        chance.uniform(0, 2 * np.pi, _WAVES),
    ])  # fmt: skip
