"""Response of a fire to wind: it leans, swings when the wind changes, and settles when it lasts:
the force on the fire status state machine (Lee et al., III-B, Figure 7a)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.field.wind import wind_velocity
from fire_atlas.recipe.wind import Wind

LEAN_PER_LEVEL = 6.0
"""Lean per level of wind, degrees: the highest level, 5, reaches the outermost state."""

_RESPONSE_TIME = 0.18
"""Time constant with which the fire follows the wind, seconds."""

_SETTLING_TIME = 0.7
"""Time constant after which a wind counts as sustained, seconds."""


@dataclass(frozen=True, slots=True)
class WindResponse:
    """Response of a fire to the wind in every frame.

    Attributes:
        level: (frames, 2) wind the fire follows, in levels, to the right and away from the front.
        steadiness: (frames,) 1 where the wind is sustained, falling to 0 where it changes fast.
    """

    level: NDArray[np.float64]
    steadiness: NDArray[np.float64]

    @classmethod
    def of(cls, wind: Wind, frames: int, fps: float, loop: bool) -> "WindResponse":
        """Return the response in ``frames`` frames; in a loop its end meets its beginning."""
        velocity = np.array([wind_velocity(wind, i / fps) for i in range(frames)])
        level = _low_passed(velocity, _RESPONSE_TIME * fps, loop)
        mean = _low_passed(level, _SETTLING_TIME * fps, loop)
        return cls(level, np.exp(-2.0 * np.hypot(*(level - mean).T)))

    def lean(self, frame: int, azimuth: float) -> float:
        """Return the lean, degrees, in the vertical plane at ``azimuth``, radians."""
        right, away = self.level[frame]
        return LEAN_PER_LEVEL * float(right * math.cos(azimuth) + away * math.sin(azimuth))

    def sway_gain(self, frame: int) -> float:
        """Return the factor of the sway: above 1 when the wind changes, below 1 when a wind is
        sustained (the state machine settles)."""
        strength = min(float(np.hypot(*self.level[frame])) / 2.0, 1.0)
        steadiness = float(self.steadiness[frame])
        return 1.0 + 0.5 * (1.0 - steadiness) - 0.6 * steadiness * strength


def _low_passed(values: NDArray[np.float64], steps: float, loop: bool) -> NDArray[np.float64]:
    """Low-pass ``values`` (frames, n) exponentially, with a time constant of ``steps`` frames."""
    share = 1.0 - math.exp(-1.0 / max(steps, 1e-6))
    state = values[0].copy()
    filtered = np.empty_like(values)
    # A loop is filtered repeatedly, until its end no longer depends on the initial state.
    passes = 1 + math.ceil(40.0 * steps / len(values)) if loop else 1
    for _ in range(passes):
        for i, value in enumerate(values):
            state = state + (value - state) * share
            filtered[i] = state
    return filtered
