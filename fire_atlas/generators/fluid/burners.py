"""Burners: places where fuel, heat and smoke enter the gas, ragged and pulsing, at a speed."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.generators.fluid.combustion import FUEL, SMOKE, TEMPERATURE
from fire_atlas.generators.fluid.grid import Field, FluidGrid
from fire_atlas.generators.fluid.noise import Cycles, scalar_noise

Vector = tuple[float, float, float]
"""(right, away, up)."""

_PULSES = (0.9, 2.3, 4.4)
"""Rates, 1/s, at which the supply of a burner swells, by falling strength."""

_STRENGTH = (0.5, 0.35, 0.3)

_TURNS = (1.4, 3.2)
"""Rates, 1/s, at which the direction of what leaves a burner turns."""

_FLICKER = (1.0, 2.4)
"""Rates, 1/s, at which the holes in a burner move."""

_PUSH = 25.0
"""Rate, 1/s, at which gas takes on the speed of a burner."""

_EDGE = 2.5
"""How steeply a burner begins at its edge; its middle is whole."""


@dataclass(frozen=True, slots=True)
class FluidBurner:
    """A place where fuel comes out: an ellipsoid with a ragged edge.

    Attributes:
        at: Its middle, heights from the origin.
        size: Half its width, depth and height, heights.
        fuel, temperature, smoke: What the gas in its middle has.
        speed: Speed of the gas, heights/s.
        direction: Where the gas goes, a unit vector.
        ragged: How far noise eats into it, 0..1.
        grain: Longest wavelength of that noise, heights.
        pulse: How far its supply swells and falls, 0..1.
        wander: How far its direction turns aside.
        spread: How far the gas spreads, of its speed.
        burning: Begin and end, s; None: always.
    """

    at: Vector
    size: Vector
    fuel: float = 1.0
    temperature: float = 0.4
    smoke: float = 0.0
    speed: float = 0.0
    direction: Vector = (0.0, 0.0, 1.0)
    ragged: float = 0.5
    grain: float = 0.08
    pulse: float = 0.3
    wander: float = 0.0
    spread: float = 0.0
    burning: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Feed:
    """A burner in a grid.

    Attributes:
        burner: The burner.
        box: The cubes that it may fill.
        full: (layers, rows, columns) of the box: how much of it is in the burner, 0..1.
        noise: Two pairs of fields of that shape, which turn into each other.
        pulse, turning, flicker: When it swells, turns and flickers.
    """

    burner: FluidBurner
    box: tuple[slice, slice, slice]
    full: Field
    noise: tuple[Field, ...]
    pulse: Cycles
    turning: Cycles
    flicker: Cycles

    @classmethod
    def of(
        cls, burner: FluidBurner, grid: FluidGrid, period: float, seed: int, number: int
    ) -> Self:
        """Place burner ``number`` of a fire in a grid; what varies repeats with ``period`` s."""
        right, away, up = (
            ((place - middle) / size) ** 2
            for place, middle, size in zip(
                (grid.right, grid.away, grid.up), burner.at, burner.size, strict=True
            )
        )
        inside = np.clip(1 - np.sqrt(right + away + up), 0, 1)
        box = tuple(slice(int(at.min()), int(at.max()) + 1) for at in np.nonzero(inside))
        layers, rows, columns = box
        chance = generator(seed, RandomStream.BURNERS, number)
        cycles = [Cycles.near(rates, period, chance) for rates in (_PULSES, _TURNS, _FLICKER)]
        full = np.minimum(inside[layers, rows, columns] * np.float32(_EDGE), 1).astype(np.float32)
        # Its own waves do not come back within a burner that is smaller than the longest of them.
        longest = max(burner.grain / grid.cell, 4.0)
        shape = full.shape[0], full.shape[1], full.shape[2]
        around = tuple(max(length, math.ceil(longest)) for length in shape)
        noise = tuple(
            np.ascontiguousarray(
                scalar_noise((around[0], around[1], around[2]), (2.2, longest), chance)[
                    : shape[0], : shape[1], : shape[2]
                ]
            )
            for _ in range(4)
        )
        return cls(burner, (layers, rows, columns), full, noise, *cycles)

    def supply(self, time: float) -> float:
        """Return how much it gives at ``time`` s, around 1."""
        swell = sum(
            strength * sine
            for strength, (_, sine) in zip(_STRENGTH, self.pulse.sines(time), strict=True)
        )
        return max(0.0, 1 + self.burner.pulse * swell)

    def add(self, velocity: Field, scalars: Field, time: float, dt: float) -> None:
        """Add what it gives at ``time`` s to the gas, in place, in a step of ``dt`` s."""
        burner = self.burner
        if burner.burning is not None and not burner.burning[0] <= time < burner.burning[1]:
            return
        supply = self.supply(time)
        (a, b), (c, d) = self.flicker.sines(time)
        weights = (a, b, 0.7 * c, 0.7 * d)
        noise = sum(np.float32(w) * field for w, field in zip(weights, self.noise, strict=True))
        hole = np.clip(np.float32(0.5) + np.float32(0.4) * noise, 0, np.float32(1.5))
        whole = np.clip(np.float32(supply) * self.full - np.float32(burner.ragged) * hole, 0, 1)
        gas = scalars[self.box]
        for channel, most in (
            (FUEL, burner.fuel),
            (TEMPERATURE, burner.temperature),
            (SMOKE, burner.smoke),
        ):
            np.maximum(gas[..., channel], np.float32(most) * whole, out=gas[..., channel])
        if burner.speed == 0:
            return
        moved = velocity[self.box]
        (_, right), (_, away) = self.turning.sines(time)
        aside = (right * burner.wander, away * burner.wander, 0.0)
        x, y, z = (along + turned for along, turned in zip(burner.direction, aside, strict=True))
        mix = np.float32(min(1.0, _PUSH * dt)) * self.full
        speed, spread = burner.speed * supply, np.float32(burner.speed * burner.spread)
        for channel, along in enumerate((x, -z, y)):
            goal = np.float32(along * speed) + spread * self.noise[channel]
            moved[..., channel] += mix * (goal - moved[..., channel])
