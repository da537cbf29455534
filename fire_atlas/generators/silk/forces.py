"""External forces on the sheets: wind, slow sway, lift by heat, gravity and flutter.

What the air and the heat do are forces, so the heavier the silk, the less they move it. Its weight
is a force too, but one that grows with its mass.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.noise import in_whole_cycles
from fire_atlas.effect.field.wind import LEVEL_SPEED, wind_velocity
from fire_atlas.generators.silk.controls import Controls
from fire_atlas.generators.silk.fuel import Fuel
from fire_atlas.generators.silk.mechanics import Vectors, lengths, normals
from fire_atlas.recipe.wind import Wind

_WAVES = 7
"""Number of waves summed for the flutter of each sheet, and for the sway."""

_GUST_GAIN = 0.5
"""Increase of flutter and sway per level of wind, relative to still air."""

_MIN_FLUTTER = 0.6
"""Minimum frequency of the flutter, Hz."""

_SWAY_WAVELENGTHS = 1.2, 4.0
"""Shortest and longest wave of the sway along the ground, heights: fires far apart sway apart."""

_STANDING = 1 - 1e-9
"""z of the direction of a sheet from which on it stands, and is no jet."""

_BENT_UP = 0.35
"""Lift upwards where the gas of a jet has become slow, relative to that along it at its nozzle."""

_BOUNDARY_LAYER = 0.12
"""Height above the ground at which the wind has half its speed, heights."""


@dataclass(frozen=True, slots=True)
class _SwayWaves:
    """Waves whose sum is the slow sway of the air.

    Attributes:
        phase: (waves,) rad.
        frequency: (waves,) rad/s.
        heading: (waves,) direction that the air sways in, rad.
        along: (2, waves) wave numbers right and away along the ground, rad/height.
    """

    phase: NDArray[np.float64]
    frequency: NDArray[np.float64]
    heading: NDArray[np.float64]
    along: NDArray[np.float64]

    @classmethod
    def random(cls, chance: np.random.Generator, period: float | None) -> Self:
        """Return waves of 0.25 to 1.6 Hz, which repeat to the right after ``period``, heights."""
        phase = chance.uniform(0, 2 * np.pi, _WAVES)
        frequency = 2 * np.pi * np.exp(chance.uniform(np.log(0.25), np.log(1.6), _WAVES))
        heading = chance.uniform(0, 2 * np.pi, _WAVES)
        shortest, longest = np.log(_SWAY_WAVELENGTHS)
        number = 2 * np.pi / np.exp(chance.uniform(shortest, longest, _WAVES))
        way = chance.uniform(0, 2 * np.pi, _WAVES)
        along = number * np.stack([np.cos(way), np.sin(way)])
        if period is not None:
            along[0] = in_whole_cycles(along[0], period)
        return cls(phase, frequency, heading, along)

    def velocity(self, time: float, x: Vectors) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the velocity right and away (sheets, rows, 1) of the air at the middle of each row
        of nodes ``x``, with an rms of 1 for both together."""
        # Waves travel upwards (0.35 s per height), so the top follows the base.
        place = np.concatenate([self.along, -0.35 * self.frequency[None]])
        waves = np.sin(x.mean(axis=2) @ place + (self.phase + self.frequency * time))
        waves *= np.sqrt(2 / len(self.phase))
        right, away = waves @ np.cos(self.heading), waves @ np.sin(self.heading)
        return right[..., None], away[..., None]


@dataclass(frozen=True, slots=True)
class SheetForces:
    """All forces on the sheets other than their springs and the intruders.

    Attributes:
        wind: The recipe's wind.
        controls: The keys that change with time.
        mass: (sheets, 1, 1) mass of the silk, relative to that for which fuels state accelerations.
        drag: (sheets, 1, 1, 1) rate at which a node takes on the velocity of the air, 1/s.
        sway: (sheets, 1, 1) speed (rms) of the slow oscillation of the air, heights/s.
        gravity: (sheets, 1, 1) acceleration downwards, heights/s².
        lift: (sheets, 1, 1) acceleration by heat at the base, heights/s².
        lift_decay: (sheets, 1, 1) distance from the base where lift falls to 1/e, heights.
        base: (sheets, 1, 1) place of the base of each sheet along ``up``, heights.
        up: (sheets, 3) unit vector from the base of each sheet to its top: of a jet its direction.
        row_phase: (sheets, rows, waves) phase of the flutter by row, rad.
        column_phase: (sheets, columns, waves) phase added by column, rad.
        flutter_frequency: (sheets, waves) angular frequency, rad/s.
        sway_waves: The waves of the sway.
        flutter: (sheets, 1, 1) acceleration (rms) at the top of a sheet in still air, heights/s².
    """

    wind: Wind
    controls: Controls
    mass: NDArray[np.float64]
    drag: NDArray[np.float64]
    sway: NDArray[np.float64]
    gravity: NDArray[np.float64]
    lift: NDArray[np.float64]
    lift_decay: NDArray[np.float64]
    base: NDArray[np.float64]
    up: NDArray[np.float64]
    row_phase: NDArray[np.float64]
    column_phase: NDArray[np.float64]
    flutter_frequency: NDArray[np.float64]
    sway_waves: _SwayWaves
    flutter: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        rest: Vectors,
        fuels: Sequence[Fuel],
        wind: Wind,
        controls: Controls,
        mass: float,
        seed: int,
        period: float | None = None,
    ) -> Self:
        """Return the forces on sheets whose nodes rest at ``rest`` and that burn ``fuels``.

        ``mass`` is a multiple of the fuels'. Sheets of a tile repeat after ``period``, heights.
        """

        def per_sheet(value: Callable[[Fuel], float]) -> NDArray[np.float64]:
            return np.array([value(fuel) for fuel in fuels])[:, None, None]

        sheets, rows, columns = rest.shape[:3]
        way = rest[:, -1, 0] - rest[:, 0, 0]
        height = lengths(way)
        direction = way / height[:, None]
        size = (sheets, 1, _WAVES)
        chance = generator(seed, RandomStream.TURBULENCE)
        # Each wave has 0.4 to 1.6 periods over the height and rises at 0.7 of the gas speed.
        up = chance.uniform(0.4, 1.6, size)
        across = chance.uniform(-0.7, 0.7, size)
        phase = chance.uniform(0, 2 * np.pi, size)
        gas_speed = per_sheet(lambda fuel: fuel.burner.gas_speed * fuel.image_rate)[..., 0]
        hertz = up[:, 0] * gas_speed * 0.7 + chance.normal(0, 0.2, size)[:, 0]
        share = np.linspace(0, 1, rows)[None, :, None]
        along = np.linspace(-0.5, 0.5, columns)[None, :, None]
        return cls(
            wind=wind,
            controls=controls,
            mass=per_sheet(lambda fuel: fuel.mass * mass),
            drag=per_sheet(lambda fuel: fuel.drag)[..., None],
            sway=per_sheet(lambda fuel: fuel.sway),
            gravity=per_sheet(lambda fuel: fuel.gravity),
            lift=per_sheet(lambda fuel: fuel.lift),
            lift_decay=per_sheet(lambda fuel: fuel.lift_height) * height[:, None, None],
            base=np.einsum("sk,sk->s", rest[:, 0, 0], direction)[:, None, None],
            up=direction,
            row_phase=2 * np.pi * up * share + phase,
            column_phase=2 * np.pi * across * along,
            # A minimum, because a wave at rest would bend its sheet to one side all the time.
            flutter_frequency=2 * np.pi * np.maximum(hertz, _MIN_FLUTTER),
            sway_waves=_SwayWaves.random(chance, period),
            flutter=per_sheet(lambda fuel: fuel.flutter),
        )

    def air_velocity(self, time: float, moment: float, x: Vectors) -> Vectors:
        """Return the air's velocity at every node, heights/s: wind and sway, growing upwards."""
        right, away = wind_velocity(self.wind, moment)
        gust = 1 + _GUST_GAIN * np.hypot(right, away)
        above = np.maximum(x[..., 2], 0.0)
        profile = above / (above + _BOUNDARY_LAYER)
        sway = self.sway_waves.velocity(time, x)
        u = np.zeros_like(x)
        for axis, wind in ((0, right), (1, away)):
            u[..., axis] = profile * (wind * LEVEL_SPEED + self.sway * gust * sway[axis])
        return u

    def acceleration(self, time: float, moment: float, x: Vectors, v: Vectors) -> Vectors:
        """Return the acceleration of every node, heights/s².

        ``time``, s, is that of the flutter and the sway, which go on; ``moment``, s, that of the
        wind and the keys with keyframes, which begin again with a loop.
        """
        controls = self.controls
        force = (self.air_velocity(time, moment, x) - v) * self.drag
        risen = np.maximum(np.einsum("srck,sk->src", x, self.up) - self.base, 0.0)
        lift = controls.lift.at(moment) * controls.pressure.at(moment) * self.lift
        fast = np.exp(-risen / self.lift_decay)
        force += (lift * fast)[..., None] * self.up[:, None, None]
        is_jet = self.up[:, 2] < _STANDING
        force[is_jet, ..., 2] += (_BENT_UP * lift * (1 - fast))[is_jet]
        a = (force + self._flutter(time, moment) * normals(x)) / self.mass[..., None]
        a[..., 2] -= controls.gravity.at(moment) * self.gravity
        return a

    def _flutter(self, time: float, moment: float) -> NDArray[np.float64]:
        """Return the force (sheets, rows, columns, 1) along the normals, for each of ``mass``,
        heights/s²."""
        strength = self.controls.turbulence.at(moment) * self.controls.oxygen.at(moment) ** 0.5
        gust = 1 + _GUST_GAIN * float(np.hypot(*wind_velocity(self.wind, moment)))
        rows = self.row_phase - (self.flutter_frequency * self.controls.gas_time(time))[:, None]
        columns = self.column_phase.transpose(0, 2, 1)
        waves = np.sin(rows) @ np.cos(columns) + np.cos(rows) @ np.sin(columns)
        share = np.linspace(0, 1, rows.shape[1])[None, :, None]
        waves *= share * (self.flutter * strength * gust * math.sqrt(2 / _WAVES))
        return np.asarray(waves[..., None])
