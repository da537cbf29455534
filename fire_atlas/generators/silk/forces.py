"""External forces on the sheets: wind, slow sway, lift by heat, gravity, and flutter."""

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
"""Number of waves summed for the flutter of a sheet, and for the sway."""

_GUST_GAIN = 0.5
"""Growth of flutter and sway with each level of wind, relative to still air."""

_MIN_FLUTTER = 0.6
"""Lowest frequency of the flutter, Hz."""

_BOUNDARY_LAYER = 0.12
"""Height in which the wind rises to half its speed above the ground, heights."""


@dataclass(frozen=True, slots=True)
class SheetForces:
    """All that accelerates the sheets besides their springs and the intruders.

    Attributes:
        fuel: The fuel.
        wind: The recipe's wind.
        gravity: heights/s².
        lift: Acceleration by heat at the base, heights/s².
        lift_decay: (sheets, 1, 1) height in which a sheet's lift falls to 1/e, heights.
        base: (sheets, 1, 1) height of the base of each sheet, heights.
        row_phase: (sheets, rows, waves) phase of the flutter along a sheet's height, rad.
        column_phase: (sheets, columns, waves) and along its width.
        flutter_frequency: (sheets, waves) rad/s.
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
        # A wave has 0.4 to 1.6 periods along the sheet, and travels up about as fast as the gas.
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
            # A wave that stood still would bend its sheet to one side for good.
            flutter_frequency=2 * np.pi * np.maximum(hertz, _MIN_FLUTTER),
            sway=_random_sway(chance),
            flutter=fuel.flutter * turbulence,
        )

    def air_velocity(self, time: float, x: Vectors) -> Vectors:
        """Velocity of the air at every node, heights/s: wind, and sway that grows with height."""
        right, away = wind_velocity(self.wind, time)
        gust = 1 + _GUST_GAIN * np.hypot(right, away)
        above = np.maximum(x[..., 2], 0.0)
        profile = above / (above + _BOUNDARY_LAYER)
        phase, frequency, heading = self.sway
        # The wave travels upwards, so that the top follows the base.
        delay = frequency * 0.35
        sway = np.sin(phase + frequency * time - delay * above[..., None])
        sway *= self.fuel.sway * gust * np.sqrt(2 / len(phase))
        u = np.zeros_like(x)
        for axis, wind, part in ((0, right, np.cos(heading)), (1, away, np.sin(heading))):
            u[..., axis] = profile * (wind * LEVEL_SPEED + np.einsum("srcw,w->src", sway, part))
        return u

    def acceleration(self, time: float, x: Vectors, v: Vectors) -> Vectors:
        """Acceleration of every node, heights/s²."""
        a = (self.air_velocity(time, x) - v) * self.fuel.drag
        risen = np.maximum(x[..., 2] - self.base, 0.0)
        a[..., 2] += self.lift * np.exp(-risen / self.lift_decay) - self.gravity
        return a + self._flutter(time) * normals(x)

    def _flutter(self, time: float) -> NDArray[np.float64]:
        """Acceleration (sheets, rows, columns, 1) along the normals, heights/s²."""
        gust = 1 + _GUST_GAIN * float(np.hypot(*wind_velocity(self.wind, time)))
        rows = self.row_phase - (self.flutter_frequency * time)[:, None]
        waves = np.einsum("srw,scw->src", np.sin(rows), np.cos(self.column_phase))
        waves += np.einsum("srw,scw->src", np.cos(rows), np.sin(self.column_phase))
        share = np.linspace(0, 1, rows.shape[1])[None, :, None]
        waves *= share * (self.flutter * gust * math.sqrt(2 / _WAVES))
        return np.asarray(waves[..., None])


def _random_sway(chance: np.random.Generator) -> NDArray[np.float64]:
    """Phase, frequency of 0.25 to 1.6 Hz, and heading of each wave of the sway, (3, waves)."""
    return np.stack([
        chance.uniform(0, 2 * np.pi, _WAVES),
        2 * np.pi * np.exp(chance.uniform(np.log(0.25), np.log(1.6), _WAVES)),
        chance.uniform(0, 2 * np.pi, _WAVES),
    ])  # fmt: skip
