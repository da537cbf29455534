"""Noise that changes with time: sums of plane waves, and curl noise (divergence-free velocity)."""

from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane, as_plane

Real = TypeVar("Real", np.float32, np.float64)


@dataclass(frozen=True, slots=True)
class PlaneWaves:
    """A sum of n travelling plane waves of angle θ = kx x + ky y + omega t + phase.

    Attributes:
        kx, ky: (n,) wave numbers, rad per unit of length.
        omega: (n,) angular frequencies, rad per unit of time.
        phase: (n,) rad.
        amplitude: (n,).
    """

    kx: NDArray[np.float64]
    ky: NDArray[np.float64]
    omega: NDArray[np.float64]
    phase: NDArray[np.float64]
    amplitude: NDArray[np.float64]

    def on_grid(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> "WavesOnGrid":
        """Return the waves on a grid, (len(y), len(x)), to be summed at many times."""
        rows, columns = _factors(np.outer(self.ky, y), np.outer(self.kx, x))
        columns *= np.tile(self.amplitude, 2)[:, None]
        sine, cosine = np.split(rows, 2)
        return WavesOnGrid(sine + 1j * cosine, as_plane(columns), self.omega, self.phase)

    def curl(
        self, time: float, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> tuple[Plane, Plane]:
        """Velocity (∂ψ/∂y, −∂ψ/∂x) of the stream function ψ = −Σ amplitude cos θ.

        Returns:
            The x and y components on a grid, each (len(y), len(x)).
        """
        # Reduced to one turn: at late times float32 would not resolve the angle.
        start = np.mod(self.phase + self.omega * time, 2 * np.pi)
        down = as_plane(np.outer(self.ky, y) + start[:, None])
        rows, columns = _factors(down, as_plane(np.outer(self.kx, x)))
        slopes = (as_plane(np.tile(k * self.amplitude, 2))[:, None] for k in (self.ky, -self.kx))
        both = np.concatenate([rows * slope for slope in slopes], axis=1).T @ columns
        return both[: len(y)], both[len(y) :]


@dataclass(frozen=True, slots=True)
class WavesOnGrid:
    """Plane waves on a grid: factors whose product sums over the waves.

    Attributes:
        rows: (n, rows) sin + i cos of the angles down the grid, at time and phase 0.
        columns: (2n, columns) cosines and sines of those across, times the amplitudes.
        omega, phase: (n,) as in ``PlaneWaves``.
    """

    rows: NDArray[np.complex128]
    columns: Plane
    omega: NDArray[np.float64]
    phase: NDArray[np.float64]

    def values(self, time: float) -> Plane:
        """Return Σ amplitude sin θ at ``time``, (rows, columns)."""
        # sin(a + b) + i cos(a + b) = (sin a + i cos a) exp(-ib): no angle is needed again.
        rotated = self.rows * np.exp(-1j * (self.phase + self.omega * time))[:, None]
        return as_plane(np.concatenate([rotated.real, rotated.imag])).T @ self.columns


def _factors(down: NDArray[Real], across: NDArray[Real]) -> tuple[NDArray[Real], NDArray[Real]]:
    """Split sin(down + across) into two factors, whose matrix product sums over the waves.

    Args:
        down, across: (n, rows) and (n, columns) angles, rad.

    Returns:
        (2n, rows) and (2n, columns).
    """
    rows = np.concatenate([np.sin(down), np.cos(down)])
    return rows, np.concatenate([np.cos(across), np.sin(across)])


def random_wave_vectors(
    chance: np.random.Generator, count: int, wavelengths: tuple[float, float], unit: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Draw waves of random direction and length, the length log-uniform.

    Args:
        chance: Source of random numbers.
        count: Number of waves, n.
        wavelengths: Shortest and longest wavelength.
        unit: Grid units per unit of ``wavelengths``.

    Returns:
        Wavelengths, in the unit of ``wavelengths``; kx and ky, rad per grid unit: each (n,).
    """
    shortest, longest = np.log(wavelengths)
    length = np.exp(chance.uniform(shortest, longest, count))
    heading = chance.uniform(0, 2 * np.pi, count)
    number = 2 * np.pi / (length * unit)
    return length, number * np.cos(heading), number * np.sin(heading)


def in_whole_cycles(number: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Return the nearest wave numbers, rad per unit, of which ``length`` units are whole cycles."""
    cycle = 2 * np.pi / length
    return np.asarray(cycle * np.rint(number / cycle))


def curl_differences(stream: Plane) -> tuple[Plane, Plane]:
    """Return the curl of a stream function on a grid, by central differences.

    Args:
        stream: (h, w), rows from the top down.

    Returns:
        (h, w) each: velocity to the right and up, not yet divided by two cell sizes.
    """
    padded = cv2.copyMakeBorder(stream, 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    right = padded[:-2, 1:-1] - padded[2:, 1:-1]
    return as_plane(right), as_plane(padded[1:-1, :-2] - padded[1:-1, 2:])


_DRAWN = 16
"""Number of pairs of waves that are drawn, of which one is used."""


def _nearest_return(waves: NDArray[np.float64], period: int) -> float:
    """Return the smallest squared distance between phases two or more steps apart of ``waves`` (n,)
    that turn so many times in ``period`` steps: each wave adds 0 if its phases are the same, 1 if
    they are opposite."""
    lags = np.arange(2, period - 1)
    distance = (np.sin(np.pi * np.outer(waves, lags) / period) ** 2).sum(axis=0)
    return float(distance.min(initial=len(waves)))


class BlurredCurlNoise:
    """Curl noise from blurred white noise, which changes smoothly and periodically with time."""

    def __init__(
        self, chance: np.random.Generator, shape: tuple[int, int], sigma: float, period: int
    ) -> None:
        """Draw noise of ``shape`` (h, w) that repeats after ``period``; ``at`` blurs it by a
        Gaussian of ``sigma`` px."""
        self._noise = chance.normal(0, 1, (6, *shape)).astype(np.float32)
        drawn = np.maximum(np.rint(chance.uniform(0.10, 0.35, (_DRAWN, 2)) * period), 1)
        # One wave is as long as the period, so that nothing repeats before it ends. Two that came
        # back together long before would leave that one alone to tell the times apart.
        waves = np.concatenate([np.ones((_DRAWN, 1)), drawn], axis=1)
        apart = [_nearest_return(wave, period) for wave in waves]
        self._frequency = waves[int(np.argmax(apart))] / period
        self._sigma = sigma

    def at(self, time: float) -> NDArray[np.float32]:
        """Return the velocity (h, w, 2), x right and y down, scaled to an rms length of 1."""
        angles = 2 * np.pi * self._frequency * time
        weights = [*np.cos(angles), *np.sin(angles)]
        stream = sum(np.float32(w) * noise for w, noise in zip(weights, self._noise, strict=True))
        stream = cv2.GaussianBlur(np.asarray(stream, np.float32), (0, 0), self._sigma)
        velocity = np.dstack(
            [cv2.Sobel(stream, cv2.CV_32F, 0, 1), -cv2.Sobel(stream, cv2.CV_32F, 1, 0)]
        )
        return as_plane(velocity / max(float(np.sqrt((velocity**2).sum(axis=-1).mean())), 1e-9))
