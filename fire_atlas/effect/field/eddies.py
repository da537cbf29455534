"""Eddies: small divergence-free turbulence in the velocity field around a fire."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.noise import PlaneWaves, in_whole_cycles, random_wave_vectors
from fire_atlas.core.pixels import Plane, as_plane

_WAVES = 28
"""Number of plane waves summed."""

_WAVELENGTHS = (0.10, 0.45)
"""Shortest and longest eddy, heights."""

_SAMPLES = 5
"""Samples per shortest eddy; interpolating between them costs less than evaluating every cell."""

_MARGIN = 4
"""Samples beyond the grid, so that interpolation never meets a border."""

_FREQUENCY = 1.1
"""Frequency of the longest eddy, Hz; others have one proportional to length^(−2/3)."""


@dataclass(frozen=True, slots=True)
class Eddies:
    """Curl noise on the grid of the velocity field.

    Attributes:
        waves: The stream function of the noise, in cells, s and px/s.
    """

    waves: PlaneWaves

    @classmethod
    def random(
        cls,
        seed: int,
        rows: int,
        speed: float,
        period: float | None = None,
        view: int = 0,
        columns: int | None = None,
    ) -> Self:
        """Draw eddies of rms ``speed`` px/s for a grid with ``rows`` cells to the frame's height.

        With a ``period``, s, each wave has a whole number of cycles in it, so the eddies repeat. So
        they do across ``columns`` cells, if given. Each ``view`` has others.
        """
        chance = generator(seed, RandomStream.EDDIES, view)
        length, kx, ky = random_wave_vectors(chance, _WAVES, _WAVELENGTHS, rows)
        if columns is not None:
            kx = in_whole_cycles(kx, columns)
        frequency = _FREQUENCY * (_WAVELENGTHS[1] / length) ** (2 / 3)
        if period is not None:
            frequency = np.maximum(np.rint(frequency * period), 1) / period
        omega = 2 * np.pi * frequency * chance.choice([-1.0, 1.0], _WAVES)
        phase = chance.uniform(0, 2 * np.pi, _WAVES)
        # All waves have the same peak speed; the mean square of a sine is half its squared peak.
        amplitude = speed * np.sqrt(2 / _WAVES) / np.hypot(kx, ky)
        return cls(PlaneWaves(kx, ky, omega, phase, amplitude))

    def velocity(self, time: float, shape: tuple[int, int]) -> tuple[Plane, Plane]:
        """Velocity in x and y, each (rows, columns), px/s, at ``time`` s."""
        step = max(1, int(_WAVELENGTHS[0] * shape[0] / _SAMPLES))
        rows, columns = (_sample_positions(count, step) for count in shape)
        u, v = self.waves.curl(time, columns, rows)
        return _interpolated(u, step, shape), _interpolated(v, step, shape)


def _sample_positions(count: int, step: int) -> NDArray[np.float64]:
    """Positions of one sample for every ``step`` of ``count`` cells, with a margin at both ends."""
    if step == 1:
        return np.arange(count, dtype=np.float64)
    numbers = np.arange(-_MARGIN, -(-count // step) + _MARGIN, dtype=np.float64)
    return numbers * step + (step - 1) / 2


def _interpolated(plane: Plane, step: int, shape: tuple[int, int]) -> Plane:
    """Interpolate samples at ``_sample_positions`` to a plane of ``shape``."""
    if step == 1:
        return plane
    size = plane.shape[1] * step, plane.shape[0] * step
    fine = as_plane(cv2.resize(plane, size, interpolation=cv2.INTER_LANCZOS4))
    start = _MARGIN * step
    return fine[start : start + shape[0], start : start + shape[1]]
