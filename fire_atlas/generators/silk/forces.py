"""External forces on the sheets: wind, slow sway, lift by heat, gravity and flutter."""

import math
from collections.abc import Callable, Sequence
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
        wind: The recipe's wind.
        drag: (sheets, 1, 1, 1) rate at which a node takes on the velocity of the air, 1/s.
        sway: (sheets, 1, 1) speed (rms) of the slow oscillation of the air, heights/s.
        gravity: (sheets, 1, 1) acceleration downwards, heights/s².
        lift: (sheets, 1, 1) acceleration upwards by heat at the base, heights/s².
        lift_decay: (sheets, 1, 1) distance above the base where lift falls to 1/e, heights.
        base: (sheets, 1, 1) z of the base of each sheet, heights.
        row_phase: (sheets, rows, waves) phase of the flutter by row, rad.
        column_phase: (sheets, columns, waves) phase added by column, rad.
        flutter_frequency: (sheets, waves) angular frequency, rad/s.
        sway_waves: (3, waves) phase (rad), frequency (rad/s) and heading (rad) of the sway.
        flutter: (sheets, 1, 1) acceleration (rms) at the top of a sheet in still air, heights/s².
    """

    wind: Wind
    drag: NDArray[np.float64]
    sway: NDArray[np.float64]
    gravity: NDArray[np.float64]
    lift: NDArray[np.float64]
    lift_decay: NDArray[np.float64]
    base: NDArray[np.float64]
    row_phase: NDArray[np.float64]
    column_phase: NDArray[np.float64]
    flutter_frequency: NDArray[np.float64]
    sway_waves: NDArray[np.float64]
    flutter: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        rest: Vectors,
        fuels: Sequence[Fuel],
        wind: Wind,
        seed: int,
        factors: tuple[float, float, float],
    ) -> Self:
        """Return the forces on sheets whose nodes rest at ``rest`` and that burn ``fuels``.

        ``factors`` are multiples of the fuels' lift, gravity and turbulence.
        """

        def each(value: Callable[[Fuel], float]) -> NDArray[np.float64]:
            return np.array([value(fuel) for fuel in fuels])[:, None, None]

        sheets, rows, columns = rest.shape[:3]
        height = rest[:, -1, 0, 2] - rest[:, 0, 0, 2]
        size = (sheets, 1, _WAVES)
        chance = generator(seed, RandomStream.TURBULENCE)
        # Each wave has 0.4 to 1.6 periods over the height and rises at 0.7 of the gas speed.
        up = chance.uniform(0.4, 1.6, size)
        across = chance.uniform(-0.7, 0.7, size)
        phase = chance.uniform(0, 2 * np.pi, size)
        gas_speed = each(lambda fuel: fuel.gas_speed)[..., 0]
        hertz = up[:, 0] * gas_speed * 0.7 + chance.normal(0, 0.2, size)[:, 0]
        share = np.linspace(0, 1, rows)[None, :, None]
        along = np.linspace(-0.5, 0.5, columns)[None, :, None]
        lift, gravity, turbulence = factors
        return cls(
            wind=wind,
            drag=each(lambda fuel: fuel.drag)[..., None],
            sway=each(lambda fuel: fuel.sway),
            gravity=each(lambda fuel: fuel.gravity * gravity),
            lift=each(lambda fuel: fuel.lift * lift),
            lift_decay=each(lambda fuel: fuel.lift_height) * height[:, None, None],
            base=rest[:, 0, 0, 2][:, None, None],
            row_phase=2 * np.pi * up * share + phase,
            column_phase=2 * np.pi * across * along,
            # A minimum, because a wave at rest would bend its sheet to one side all the time.
            flutter_frequency=2 * np.pi * np.maximum(hertz, _MIN_FLUTTER),
            sway_waves=_random_sway(chance),
            flutter=each(lambda fuel: fuel.flutter * turbulence),
        )

    def air_velocity(self, time: float, x: Vectors) -> Vectors:
        """Return the air's velocity at every node, heights/s: wind and sway, growing upwards."""
        right, away = wind_velocity(self.wind, time)
        gust = 1 + _GUST_GAIN * np.hypot(right, away)
        above = np.maximum(x[..., 2], 0.0)
        profile = above / (above + _BOUNDARY_LAYER)
        phase, frequency, heading = self.sway_waves
        # Waves travel upwards (0.35 s per height), so the top follows the base.
        delay = frequency * 0.35
        sway = np.sin(phase + frequency * time - delay * above[..., None])
        sway *= (self.sway * gust * np.sqrt(2 / len(phase)))[..., None]
        u = np.zeros_like(x)
        for axis, wind, part in ((0, right, np.cos(heading)), (1, away, np.sin(heading))):
            u[..., axis] = profile * (wind * LEVEL_SPEED + sway @ part)
        return u

    def acceleration(self, time: float, x: Vectors, v: Vectors) -> Vectors:
        """Return the acceleration of every node, heights/s²."""
        a = (self.air_velocity(time, x) - v) * self.drag
        risen = np.maximum(x[..., 2] - self.base, 0.0)
        a[..., 2] += self.lift * np.exp(-risen / self.lift_decay) - self.gravity
        return a + self._flutter(time) * normals(x)

    def _flutter(self, time: float) -> NDArray[np.float64]:
        """Return the acceleration (sheets, rows, columns, 1) along the normals, heights/s²."""
        gust = 1 + _GUST_GAIN * float(np.hypot(*wind_velocity(self.wind, time)))
        rows = self.row_phase - (self.flutter_frequency * time)[:, None]
        columns = self.column_phase.transpose(0, 2, 1)
        waves = np.sin(rows) @ np.cos(columns) + np.cos(rows) @ np.sin(columns)
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
