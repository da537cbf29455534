"""Noise that repeats with a loop: in space and time, and in time alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Field = npt.NDArray[np.float32]


@dataclass(frozen=True)
class LoopNoise:
    """Band-limited noise, a sum of plane waves that repeats every ``period`` frames."""

    waves: Field  #: (axes, n) radians per pixel; axis -2 points down
    turns: Field  #: (n,) whole turns per period
    phase: Field  #: (n,) radians
    period: float

    @classmethod
    def draw(
        cls,
        rng: np.random.Generator,
        wavelengths: tuple[float, float],
        period: float,
        speed: float,
        count: int = 40,
        axes: int = 2,
    ) -> LoopNoise:
        """Draw ``count`` waves which drift upwards at about ``speed`` pixels a frame."""
        shortest, longest = wavelengths
        wavelength = shortest * (longest / shortest) ** rng.uniform(0, 1, count)
        way = rng.normal(size=(axes, count))
        waves = 2 * np.pi / wavelength * way / np.linalg.norm(way, axis=0)
        drift = waves[-2] * speed * period / (2 * np.pi)
        turns = np.round(drift + rng.normal(0.0, 0.8, count))
        phase = rng.uniform(0, 2 * np.pi, count)
        single = np.float32
        return cls(waves.astype(single), turns.astype(single), phase.astype(single), period)

    def sample(self, places: Sequence[npt.ArrayLike], time: float) -> Field:
        """Values of about unit variance at ``time`` frames, on the grid whose axes have their
        points at ``places``, pixels."""
        now = self.phase + 2 * np.pi * self.turns * np.float32((time / self.period) % 1.0)
        *others, last = (
            np.exp(1j * np.ravel(points)[:, None] * wave).astype(np.complex64)
            for points, wave in zip(places, self.waves, strict=True)
        )
        spread = np.exp(1j * now).astype(np.complex64)
        for factor in others:
            spread = spread[..., None, :] * factor
        return np.asarray((spread @ last.T).real * np.sqrt(2.0 / len(now)), dtype=np.float32)


@dataclass(frozen=True)
class LoopSeries:
    """Series of time alone, some at once, that repeat every ``period`` frames."""

    cosines: npt.NDArray[np.float64]  #: (series, waves)
    sines: npt.NDArray[np.float64]
    period: float

    @classmethod
    def draw(cls, rng: np.random.Generator, count: int, period: float, fastest: int) -> LoopSeries:
        """Draw ``count`` series of waves of one to ``fastest`` turns per period."""
        cosines, sines = rng.normal(size=(2, count, fastest)) / np.sqrt(fastest)
        return cls(cosines, sines, period)

    def __call__(self, time: float) -> Field:
        """Values (count,) of about unit variance at ``time`` frames."""
        turns = 2 * np.pi * time / self.period * np.arange(1, self.cosines.shape[1] + 1)
        now = self.cosines @ np.cos(turns) + self.sines @ np.sin(turns)
        return np.asarray(now, dtype=np.float32)
