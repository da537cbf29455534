"""Eddies: small divergence-free turbulence in the air around a fire."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.core.pixels import Plane, as_plane

_MODES = 28
_WAVELENGTHS = (0.10, 0.45)
"""Shortest and longest eddy, heights."""

_SAMPLES = 5
"""Samples of the shortest eddy; what lies between them is interpolated, which costs less."""

_BEYOND = 4
"""Samples beyond the grid, so that interpolation never meets a border."""

_TURNOVER = 1.1
"""Angular frequency of the longest eddy, rad/s per rad; shorter ones turn faster."""


@dataclass(frozen=True, slots=True)
class Eddies:
    """Curl of a stream function that is a sum of plane waves: divergence-free by construction.

    Attributes:
        kx, ky: (modes,) wave numbers, rad per cell.
        omega: (modes,) angular frequency, rad/s.
        phase: (modes,) rad.
        weight: Amplitude of each wave's velocity, px/s.
    """

    kx: NDArray[np.float64]
    ky: NDArray[np.float64]
    omega: NDArray[np.float64]
    phase: NDArray[np.float64]
    weight: float

    @classmethod
    def random(cls, seed: int, rows: int, speed: float, period: float | None = None) -> "Eddies":
        """Eddies of rms ``speed`` px/s for a grid with ``rows`` cells over the frame's height.

        With a ``period``, s, every wave turns a whole number of times in it, so they repeat.
        """
        chance = generator(seed, Stage.EDDIES)
        shortest, longest = np.log(_WAVELENGTHS)
        length = np.exp(chance.uniform(shortest, longest, _MODES))
        heading = chance.uniform(0, 2 * np.pi, _MODES)
        number = 2 * np.pi / (length * rows)
        swing = _TURNOVER * (_WAVELENGTHS[1] / length) ** (2 / 3)
        if period is not None:
            swing = np.maximum(np.rint(swing * period), 1) / period
        omega = 2 * np.pi * swing * chance.choice([-1.0, 1.0], _MODES)
        phase = chance.uniform(0, 2 * np.pi, _MODES)
        # Every wave's velocity is weight·sin, so the mean square of the sum is modes·weight²/2.
        weight = speed * np.sqrt(2 / _MODES)
        return cls(number * np.cos(heading), number * np.sin(heading), omega, phase, weight)

    def velocity(self, time: float, shape: tuple[int, int]) -> tuple[Plane, Plane]:
        """u and v, each (rows, columns), px/s, at ``time`` s.

        sin(kx x + ky y + p) is split into products of row and column vectors, so that the sum over
        all waves is one matrix product.
        """
        step = max(1, int(_WAVELENGTHS[0] * shape[0] / _SAMPLES))
        rows, columns = (_samples(n, step) for n in shape)
        across = as_plane(np.outer(self.kx, columns))
        # A wave is as it was a turn ago: float32 then is exact enough, however late it is.
        start = np.mod(self.phase + self.omega * time, 2 * np.pi)
        down = as_plane(np.outer(self.ky, rows) + start[:, None])
        waves = np.concatenate([np.cos(across), np.sin(across)])
        sines = np.concatenate([np.sin(down), np.cos(down)])
        share = self.weight / np.hypot(self.kx, self.ky)
        u_and_v = np.concatenate([
            sines * as_plane(np.tile(along * share, 2))[:, None] for along in (self.ky, -self.kx)
        ], axis=1)  # fmt: skip
        both = u_and_v.T @ waves
        return _finer(both[: len(rows)], step, shape), _finer(both[len(rows) :], step, shape)


def _samples(cells: int, step: int) -> NDArray[np.float64]:
    """Places, in cells, of one sample for every ``step`` of them, and some beyond both ends."""
    if step == 1:
        return np.arange(cells, dtype=np.float64)
    numbers = np.arange(-_BEYOND, -(-cells // step) + _BEYOND, dtype=np.float64)
    return numbers * step + (step - 1) / 2


def _finer(plane: Plane, step: int, shape: tuple[int, int]) -> Plane:
    """Plane of ``shape`` from its ``_samples`` down and across."""
    if step == 1:
        return plane
    size = plane.shape[1] * step, plane.shape[0] * step
    fine = as_plane(cv2.resize(plane, size, interpolation=cv2.INTER_LANCZOS4))
    start = _BEYOND * step
    return fine[start : start + shape[0], start : start + shape[1]]
