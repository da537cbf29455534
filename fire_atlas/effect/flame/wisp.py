"""A wisp of smoke over what has just burnt: threads that rise, meander and thin out."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.pixels import Plane, as_plane

LIGHT = np.float32(0.16)
"""Light of the smoke, linear: it is grey."""

_SPEED = 0.5
"""Speed at which it rises, heights/s."""

_SWELL = 0.25
"""Time in which a thread gets as dense as it is, s."""

_SWELL_UP = 0.06
"""Height over which it begins to be seen, heights."""

_DENSITY, _HEIGHT = 0.6, 0.5
"""Coverage of a thread where it begins, and height over which it thins out, heights."""

_THIN, _THICK, _SPREAD = 0.004, 0.04, 0.085
"""Half of a thread's width where it begins: of the thinnest, heights, and the part of the fire's
width by which it is more; and the part of its height by which it grows."""

_SWAY, _WAVES = 0.16, (0.31, 0.14)
"""How far a thread meanders, of its height, and how long its bends are, heights."""

_LATEST = 0.25
"""Latest time at which a thread begins, s after the first."""

_GATHER = 0.12
"""Height over which threads gather over the middle of the fire, heights."""

_APART, _MOST = 0.09, 5
"""Distance between threads, heights, and their greatest number."""


@dataclass(frozen=True, slots=True)
class Wisp:
    """Threads of smoke from a place that has burnt.

    Attributes:
        size: (width, height) of the frame, px.
        feet: (threads, 2) where they begin, px.
        phases: (threads, waves) of their bends, radians.
        begins: (threads,) when each begins, s.
        density: (threads,) how dense each is, 0..1.
        half_width: Half of their width where they begin, heights.
        drift: Speed at which wind carries them to the right, heights/s.
    """

    size: tuple[int, int]
    feet: NDArray[np.float64]
    phases: NDArray[np.float64]
    begins: NDArray[np.float64]
    density: NDArray[np.float64]
    half_width: float
    drift: float

    @classmethod
    def over(
        cls,
        size: tuple[int, int],
        foot: tuple[float, float],
        width: float,
        drift: float,
        seed: int,
    ) -> Self:
        """Return the threads over a fire with this ``foot``, px, that was ``width`` px wide."""
        height = size[1]
        count = int(np.clip(round(0.7 * width / (_APART * height)), 1, _MOST))
        chance = generator(seed, RandomStream.PHASES, 1)
        places = (np.arange(count) - (count - 1) / 2 + chance.uniform(-0.3, 0.3, count)) / count
        feet = np.column_stack([foot[0] + 0.7 * width * places, np.full(count, foot[1])])
        phases = chance.uniform(0, 2 * np.pi, (count, len(_WAVES)))
        begins = chance.uniform(0, _LATEST, count)
        begins[0] = 0.0
        density = chance.uniform(0.4, 1, count)
        density[0] = 1.0
        return cls(size, feet, phases, begins, density, _THIN + _THICK * width / height, drift)

    def coverage(self, time: float, share: float) -> Plane:
        """Return how much they cover, (H, W) in 0..1, ``time`` s after they began to rise; they are
        as dense as their ``share`` says, 0..1."""
        width, height = self.size
        clear = np.ones((height, width), np.float32)
        x = np.arange(width) + 0.5
        center = self.feet[:, 0].mean()
        for k, ((across, down), phases) in enumerate(zip(self.feet, self.phases, strict=True)):
            # Of each row: how far it is above the foot, heights, and how old its smoke is, s.
            up = np.maximum((down - np.arange(height) - 0.5) / height, 0)
            age = up / _SPEED
            bends = sum(
                wave / _WAVES[0] * np.sin(2 * np.pi * (up - _SPEED * time) / wave + phase)
                for wave, phase in zip(_WAVES, phases, strict=True)
            )
            inwards = (center - across) * up / (up + _GATHER)
            middle = across + inwards + height * (self.drift * age + _SWAY * up * bends)
            half = height * (self.half_width + _SPREAD * up)
            since = time - self.begins[k] - age
            swelling = np.clip(since / _SWELL, 0, 1) * np.minimum(up / _SWELL_UP, 1)
            # A thread that gets wider has as much smoke, and loses some of it.
            dense = swelling * np.sqrt(height * self.half_width / half) / (1 + (up / _HEIGHT) ** 2)
            away = (x - middle[:, None]) / half[:, None]
            thread = dense[:, None] * np.clip(1 - away**2 / 4, 0, 1) ** 2
            clear *= (1 - _DENSITY * self.density[k] * share * thread).astype(np.float32)
        return as_plane(1 - clear)
