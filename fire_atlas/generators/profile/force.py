"""The fire status state machine: wind in, lean out (Lee et al., III-B, Figure 7)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.field.wind import fit_gusts, wind_velocity
from fire_atlas.generators.profile.states import Period
from fire_atlas.recipe.wind import Wind

PER_LEVEL = 6.0
"""Degrees of lean that a level of wind keeps up: the highest, 5, reaches the outermost state."""

_INERTIA = 0.18
"""Seconds in which the fire follows the wind."""

_PATIENCE = 0.7
"""Seconds after which a force counts as sustained."""

_STILL = 0.25
"""Wind of a lower level than this is none."""


@dataclass(frozen=True, slots=True)
class Weather:
    """What the wind does to the fire in every frame.

    Attributes:
        force: (frames, 2) level of the wind the fire feels: to the right, and away.
        calm: (frames,) 1 where that force is a sustained one, towards 0 where it changes.
    """

    force: NDArray[np.float64]
    calm: NDArray[np.float64]

    @classmethod
    def of(cls, wind: Wind, frames: int, fps: float, loop: bool) -> "Weather":
        """Return the weather of ``frames`` frames; that of a loop closes."""
        if loop:
            wind = fit_gusts(wind, frames / fps)
        blows = np.array([wind_velocity(wind, i / fps) for i in range(frames)])
        force = _followed(blows, _INERTIA * fps, loop)
        mean = _followed(force, _PATIENCE * fps, loop)
        calm = np.exp(-2.0 * np.hypot(*(force - mean).T))
        return cls(force, calm)

    def lean(self, frame: int, plane: float) -> float:
        """Lean, degrees, in the vertical plane at azimuth ``plane`` (radians)."""
        right, away = self.force[frame]
        return PER_LEVEL * float(right * math.cos(plane) + away * math.sin(plane))

    def swing(self, frame: int) -> float:
        """How far the fire sways, 1 in still air: more when the wind changes, and less and less
        the longer a force is sustained (the machine settles)."""
        strength = min(float(np.hypot(*self.force[frame])) / 2.0, 1.0)
        calm = float(self.calm[frame])
        return 1.0 + 0.5 * (1.0 - calm) - 0.6 * calm * strength

    def state(self, frame: int, plane: float) -> tuple[float, Period] | None:
        """Lean and period that frames are fetched for; None in still air: any of the clip's."""
        lean = self.lean(frame, plane)
        if abs(lean) < _STILL * PER_LEVEL:
            return None
        return lean, "rest" if self.calm[frame] > 0.6 else "swing"


def _followed(values: NDArray[np.float64], steps: float, loop: bool) -> NDArray[np.float64]:
    """``values`` (frames, n) as something sees them that follows within ``steps`` frames."""
    share = 1.0 - math.exp(-1.0 / max(steps, 1e-6))
    state = values[0].copy()
    followed = np.empty_like(values)
    # A loop is walked through until its end has forgotten how it began.
    rounds = 1 + math.ceil(40.0 * steps / len(values)) if loop else 1
    for _ in range(rounds):
        for i, value in enumerate(values):
            state = state + (value - state) * share
            followed[i] = state
    return followed
