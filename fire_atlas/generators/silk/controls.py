"""Keys of a recipe that may change while a fire burns: pressure, oxygen, lift and others."""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import RecipeError
from fire_atlas.recipe.silk import Keyframes, SilkSource

_MAX_HEIGHT = 1.15
"""Limit of the height of a flame, relative to its fuel's own, reached at a pressure of 1.6."""

_PIECES = 64
"""Parts of the time between two keyframes over which the speed of the gas is summed."""


@dataclass(frozen=True, slots=True)
class Curve:
    """A number over time: linear between keyframes, before and after them constant.

    Attributes:
        times: (k,) s, ascending.
        values: (k,).
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    @classmethod
    def of(cls, key: float | Keyframes) -> Self:
        """Read a key of a recipe."""
        if isinstance(key, Keyframes):
            moments = key.keyframes
            return cls(
                tuple(keyframe.t for keyframe in moments),
                tuple(keyframe.value for keyframe in moments),
            )
        return cls((0.0,), (key,))

    def at(self, time: float) -> float:
        """Return the number at ``time`` s."""
        if len(self.values) == 1:
            return self.values[0]
        return float(np.interp(time, self.times, self.values))


@dataclass(frozen=True)
class Controls:
    """The keys that may change while a fire burns, each a multiple of the fuel's own.

    Attributes:
        pressure: Of the fuel. It drives the fuel out: springs and lift are proportional to it, the
            speed of the gas to its square root.
        oxygen: It sets the speed, heat and light of the combustion.
        lift, gravity, turbulence: Multiples of these forces.
    """

    pressure: Curve
    oxygen: Curve
    lift: Curve
    gravity: Curve
    turbulence: Curve

    @classmethod
    def of(cls, source: SilkSource) -> Self:
        """Read the keys of a recipe."""
        return cls(
            Curve.of(source.pressure),
            Curve.of(source.oxygen),
            Curve.of(source.lift),
            Curve.of(source.gravity),
            Curve.of(source.turbulence),
        )

    def gas_speed(self, time: float) -> float:
        """Return the speed of the gas at ``time`` s, a multiple of the fuel's own."""
        return float((self.pressure.at(time) * self.oxygen.at(time)) ** 0.5)

    def flame_height(self, time: float) -> float:
        """Return the height of the flame at ``time`` s, a multiple of the fuel's own: up to
        ``_MAX_HEIGHT``, because no flame is higher than its sheet."""
        return float(min(self.pressure.at(time) ** 0.3, _MAX_HEIGHT))

    @property
    def greatest_height(self) -> float:
        """The highest ``flame_height`` at any time."""
        return max(self.flame_height(time) for time in self.pressure.times)

    def gas_time(self, time: float) -> float:
        """Return the time, s, in which gas at the fuel's own speed goes as far as from 0 to
        ``time`` s."""
        times, passed = self._passed
        if len(times) > 1 and times[0] <= time <= times[-1]:
            return float(np.interp(time, times, passed))
        end = 0 if time < times[0] else -1
        return float(passed[end] + (time - times[end]) * self.gas_speed(time))

    @cached_property
    def _passed(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times, s, and ``gas_time`` at these."""
        keys = np.unique([0.0, *self.pressure.times, *self.oxygen.times])
        at = np.arange((len(keys) - 1) * _PIECES + 1) / _PIECES
        times = np.interp(at, np.arange(len(keys)), keys)
        speed = np.array([self.gas_speed(float(time)) for time in times])
        passed = np.cumsum(np.diff(times) * (speed[1:] + speed[:-1]) / 2)
        return times, np.concatenate([[0.0], passed])

    def check_loop(self, duration: float) -> None:
        """Check that each key ends a loop of ``duration`` s as it began.

        Raises:
            RecipeError: One would jump.
        """
        for key in (field.name for field in fields(self)):
            curve: Curve = getattr(self, key)
            first, last = curve.at(0.0), curve.at(duration)
            if not np.isclose(first, last, rtol=1e-6, atol=1e-9):
                raise RecipeError(
                    f"begins at {first:g} but is {last:g} after {duration:g} s, when the loop "
                    f"starts again, so the fire would jump; add a keyframe that brings it back to "
                    f"{first:g} by then, or play once with timeline.loop: none",
                    key=("source", key),
                )
