"""Noise that moves and repeats: sums of fields, weighted by sines of whole cycles of a period."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from fire_atlas.generators.fluid.grid import Field, FluidGrid

_FALL = -11 / 3
"""Exponent of the power of a wave of turbulence by its number, in three dimensions (Kolmogorov)."""


@dataclass(frozen=True, slots=True)
class Cycles:
    """Numbers of whole cycles in a period, and where they begin.

    Attributes:
        period: s.
        cycles: (n,) whole numbers.
        phase: (n,) rad.
    """

    period: float
    cycles: NDArray[np.float64]
    phase: NDArray[np.float64]

    @classmethod
    def near(cls, rates: tuple[float, ...], period: float, chance: np.random.Generator) -> Self:
        """Draw cycles near ``rates``, 1/s, no two alike where the period has so many."""
        wanted = np.array(rates) * chance.uniform(0.8, 1.25, len(rates))
        cycles = np.maximum(np.rint(wanted * period), 1 + np.arange(len(rates)))
        return cls(period, cycles, chance.uniform(0, 2 * np.pi, len(rates)))

    def sines(self, time: float) -> list[tuple[float, float]]:
        """Return cosine and sine of each angle at ``time`` s."""
        turns = self.cycles * (time / self.period) + self.phase / (2 * np.pi)
        angles = [2 * math.pi * (turn % 1.0) for turn in turns.tolist()]
        return [(math.cos(angle), math.sin(angle)) for angle in angles]


def random_waves(
    shape: tuple[int, int, int],
    wavelengths: tuple[float, float],
    chance: np.random.Generator,
) -> NDArray[np.complex128]:
    """Draw the spectrum of noise of wavelengths (shortest, longest), in cubes, that repeats beyond
    a box of ``shape``."""
    white = scipy.fft.rfftn(chance.normal(size=shape))
    number = np.sqrt(sum(axis * axis for axis in _numbers(shape)))
    within = (number >= 1 / wavelengths[1]) & (number <= 1 / wavelengths[0])
    return np.where(within, white * np.maximum(number, 1e-9) ** (_FALL / 2), 0)


def scalar_noise(
    shape: tuple[int, int, int], wavelengths: tuple[float, float], chance: np.random.Generator
) -> Field:
    """Draw noise of root mean square 1; if no wave fits the box, none."""
    return _of_unit(scipy.fft.irfftn(random_waves(shape, wavelengths, chance), s=shape))


def curl_noise(
    shape: tuple[int, int, int], wavelengths: tuple[float, float], chance: np.random.Generator
) -> Field:
    """Draw a velocity (3, layers, rows, columns), right, down and away, of root mean square 1: the
    curl of noise, so that it is free of sources (R. Bridson, "Curl-Noise for Procedural Fluid
    Flow", 2007)."""
    kz, ky, kx = _numbers(shape)
    a, b, c = (random_waves(shape, wavelengths, chance) for _ in range(3))
    spectra = (1j * (ky * c - kz * b), 1j * (kz * a - kx * c), 1j * (kx * b - ky * a))
    return _of_unit(np.stack([scipy.fft.irfftn(part, s=shape) for part in spectra]))


def _numbers(shape: tuple[int, int, int]) -> list[NDArray[np.float64]]:
    """Return the wave numbers, cycles per cube, along each axis."""
    layers, rows, columns = shape
    return [
        scipy.fft.fftfreq(layers)[:, None, None],
        scipy.fft.fftfreq(rows)[:, None],
        scipy.fft.rfftfreq(columns),
    ]


def _of_unit(values: NDArray[np.float64]) -> Field:
    return np.asarray(values / max(math.sqrt(float((values * values).mean())), 1e-12), np.float32)


_RATES = (0.9, 2.2)
"""How often large and small eddies turn over, 1/s."""

_SPLIT = 0.12
"""Wavelength between large and small eddies, heights."""

_EDDIES = (0.03, 0.35)
"""Shortest and longest wavelength of the eddies that stir, heights."""

_SHORTEST = 3.5
"""Shortest wavelength that a grid can carry, cubes."""


@dataclass(frozen=True, slots=True)
class Stirring:
    """Curl noise that repeats with a period: for each of its cycles two fields, which turn into
    each other.

    Attributes:
        cycles: How often.
        fields: (cycles, 2, 3, layers, rows, columns), heights/s² of root mean square 1 in all.
    """

    cycles: Cycles
    fields: Field

    @classmethod
    def of(cls, grid: FluidGrid, period: float, chance: np.random.Generator) -> Self:
        """Draw the stirring of a grid."""
        shortest, split, longest = (
            max(length / grid.cell, _SHORTEST * (1 + 0.1 * k))
            for k, length in enumerate((_EDDIES[0], _SPLIT, _EDDIES[1]))
        )
        cycles = Cycles.near(_RATES, period, chance)
        fields = [
            [curl_noise(grid.shape, wavelengths, chance) for _ in range(2)]
            for wavelengths in ((split, longest), (shortest, split))
        ]
        return cls(cycles, np.asarray(fields, np.float32) * np.float32(math.sqrt(0.5)))

    def weights(self, time: float) -> list[tuple[np.float32, np.float32]]:
        """Return the weights of the fields at ``time`` s."""
        return [(np.float32(a), np.float32(b)) for a, b in self.cycles.sines(time)]

    def at(
        self, weights: list[tuple[np.float32, np.float32]], channel: int, layers: slice
    ) -> Field:
        """Return one channel of the acceleration in some layers."""
        total = np.float32(0) * self.fields[0, 0, channel, layers]
        for (first, second), pair in zip(weights, self.fields, strict=True):
            total += first * pair[0, channel, layers]
            total += second * pair[1, channel, layers]
        return total
