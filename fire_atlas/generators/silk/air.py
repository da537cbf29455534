"""The air between the sheets: wind, its slow sway, lift by heat, and flutter across the sheets."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.effect.field.wind import LEVEL_SPEED, wind_velocity
from fire_atlas.generators.silk.fuel import Fuel
from fire_atlas.generators.silk.mechanics import normals
from fire_atlas.generators.silk.mesh import Vectors
from fire_atlas.recipe.wind import Wind

_WAVES = 7
"""Waves of flutter on a sheet, and of the sway."""

_GUSTINESS = 0.5
"""Growth of flutter and sway with each level of wind, against their own: wind is never even."""

_SLOWEST = 0.6
"""Slowest flutter, Hz."""

_GROUND = 0.12
"""Height, heights, under which the ground slows the wind down."""


@dataclass(frozen=True, slots=True)
class Air:
    """What moves the sheets besides their springs.

    Attributes:
        fuel: What burns.
        wind: The recipe's wind.
        gravity: heights/s².
        lift: Acceleration by heat at the base, heights/s².
        decay: (sheets, 1, 1) height above its base in which a sheet's lift falls to 1/e, heights.
        base: (sheets, 1, 1) height of the base of each sheet, heights.
        rows, columns: Waves of flutter: phases (sheets, rows, waves), (sheets, columns, waves).
        swing: (sheets, waves) their frequencies, rad/s.
        sway: Phase, frequency (rad/s) and heading (rad) of each wave of the sway, (3, waves).
        flutter: Acceleration (rms) at the top of a sheet in still air, heights/s².
    """

    fuel: Fuel
    wind: Wind
    gravity: float
    lift: float
    decay: NDArray[np.float64]
    base: NDArray[np.float64]
    rows: NDArray[np.float64]
    columns: NDArray[np.float64]
    swing: NDArray[np.float64]
    sway: NDArray[np.float64]
    flutter: float

    @classmethod
    def around(
        cls, rest: Vectors, fuel: Fuel, wind: Wind, seed: int, factors: tuple[float, float, float]
    ) -> "Air":
        """Air around sheets that hang as ``rest``; factors of lift, gravity and turbulence."""
        sheets, rows, columns = rest.shape[:3]
        height = rest[:, -1, 0, 2] - rest[:, 0, 0, 2]
        size = (sheets, 1, _WAVES)
        chance = generator(seed, Stage.TURBULENCE)
        # Along the sheet a wave has 0.4 to 1.6 lengths, and runs up as fast as the gas does.
        up = chance.uniform(0.4, 1.6, size)
        across = chance.uniform(-0.7, 0.7, size)
        phase = chance.uniform(0, 2 * np.pi, size)
        hertz = up[:, 0] * fuel.gas * 0.7 + chance.normal(0, 0.2, size)[:, 0]
        # A wave that stood still would bend its sheet aside for good.
        swing = 2 * np.pi * np.maximum(hertz, _SLOWEST)
        share = np.linspace(0, 1, rows)[None, :, None]
        along = np.linspace(-0.5, 0.5, columns)[None, :, None]
        sway = np.stack([
            chance.uniform(0, 2 * np.pi, _WAVES),
            2 * np.pi * np.exp(chance.uniform(np.log(0.25), np.log(1.6), _WAVES)),
            chance.uniform(0, 2 * np.pi, _WAVES),
        ])  # fmt: skip
        lift, gravity, turbulence = factors
        column = (slice(None), None, None)
        return cls(
            fuel=fuel,
            wind=wind,
            gravity=fuel.gravity * gravity,
            lift=fuel.lift * lift,
            decay=(fuel.lift_height * height)[column],
            base=rest[:, 0, 0, 2][column],
            rows=2 * np.pi * up * share + phase,
            columns=2 * np.pi * across * along,
            swing=swing,
            sway=sway,
            flutter=fuel.flutter * turbulence,
        )

    def velocity(self, time: float, x: Vectors) -> Vectors:
        """Speed of the air at every node, heights/s: the wind, and a sway that swells upwards."""
        right, away = wind_velocity(self.wind, time)
        gusty = 1 + _GUSTINESS * np.hypot(right, away)
        above = np.maximum(x[..., 2], 0.0)
        grown = above / (above + _GROUND)
        phase, frequency, heading = self.sway
        # The wave climbs with the flame, so that the top follows the foot.
        late = frequency * 0.35
        swing = np.sin(phase + frequency * time - late * above[..., None])
        swing *= self.fuel.sway * gusty * np.sqrt(2 / len(phase))
        u = np.zeros_like(x)
        u[..., 0] = grown * (right * LEVEL_SPEED + np.einsum("srcw,w->src", swing, np.cos(heading)))
        u[..., 1] = grown * (away * LEVEL_SPEED + np.einsum("srcw,w->src", swing, np.sin(heading)))
        return u

    def acceleration(self, time: float, x: Vectors, v: Vectors) -> Vectors:
        """Acceleration of every node, heights/s²."""
        a = (self.velocity(time, x) - v) * self.fuel.drag
        risen = np.maximum(x[..., 2] - self.base, 0.0)
        a[..., 2] += self.lift * np.exp(-risen / self.decay) - self.gravity
        return a + self._flutter(time) * normals(x)

    def _flutter(self, time: float) -> NDArray[np.float64]:
        """Acceleration (sheets, rows, columns, 1) along the normals."""
        gusty = 1 + _GUSTINESS * float(np.hypot(*wind_velocity(self.wind, time)))
        rows = self.rows - (self.swing * time)[:, None]
        waves = np.einsum("srw,scw->src", np.sin(rows), np.cos(self.columns))
        waves += np.einsum("srw,scw->src", np.cos(rows), np.sin(self.columns))
        share = np.linspace(0, 1, self.rows.shape[1])[None, :, None]
        waves *= share * (self.flutter * gusty * math.sqrt(2 / _WAVES))
        return np.asarray(waves[..., None])
