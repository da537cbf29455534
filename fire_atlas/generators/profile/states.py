"""Leaning states: which frames show the fire leaning how (Lee et al., III-B, Figure 7)."""

import itertools
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

BAND = 10.0
"""Width of a leaning state, degrees."""

EDGES = (-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0)
"""Six states, from -30 to 30 degrees; what leans further belongs to the outermost."""

Period = Literal["swing", "rest"]
"""Frames in which the lean changes fast, and frames in which it hardly does."""

Origin = Literal["own", "mirrored", "sheared"]
"""Frames of that lean; frames of the opposite lean, mirrored; those nearest to it, sheared."""

_LEAST = 2
"""A set of fewer frames than this borrows others."""


@dataclass(frozen=True, slots=True)
class LeaningSet:
    """Frames that show one state in one period.

    Attributes:
        low, high: Lean of the state, degrees.
        period: ``swing`` or ``rest``.
        origin: Where the frames are from.
        frames: Their numbers, in order.
    """

    low: float
    high: float
    period: Period
    origin: Origin
    frames: tuple[int, ...]


def leaning_sets(leans: NDArray[np.float64]) -> tuple[LeaningSet, ...]:
    """Twelve sets: six states, each in two periods.

    The paper has twelve sets, "each captured in one period of time", and says no more of the
    periods. Here they are what its state machine needs: a force that sets in makes the fire swing,
    a sustained one lets it rest. A state of which the clip shows too little borrows the frames of
    the opposite one, or else those that lean most like it.

    Args:
        leans: (frames,) degrees.
    """
    speed = np.abs(np.gradient(leans)) if len(leans) > 1 else np.zeros(1)
    swings = speed > np.median(speed)
    periods: dict[Period, NDArray[np.bool_]] = {"swing": swings, "rest": ~swings}
    sets = []
    for low, high in itertools.pairwise(EDGES):
        for period, belongs in periods.items():
            origin, frames = _frames(leans, belongs, low, high)
            sets.append(LeaningSet(low, high, period, origin, frames))
    return tuple(sets)


def _frames(
    leans: NDArray[np.float64], belongs: NDArray[np.bool_], low: float, high: float
) -> tuple[Origin, tuple[int, ...]]:
    own = np.flatnonzero(belongs & _within(leans, low, high))
    if own.size >= _LEAST:
        return "own", tuple(map(int, own))
    mirrored = np.flatnonzero(belongs & _within(-leans, low, high))
    if mirrored.size >= _LEAST:
        return "mirrored", tuple(map(int, mirrored))
    apart = np.abs(leans - (low + high) / 2) + np.where(belongs, 0.0, BAND)
    nearest = np.sort(np.argsort(apart, kind="stable")[: max(_LEAST, len(leans) // 6)])
    return "sheared", tuple(map(int, nearest))


def _within(leans: NDArray[np.float64], low: float, high: float) -> NDArray[np.bool_]:
    """Which leans lie between; the outermost states have no outer end."""
    return ((leans >= low) | (low == EDGES[0])) & ((leans < high) | (high == EDGES[-1]))


def state_of(lean: float) -> int:
    """Index of the state a lean (degrees) belongs to, 0..5."""
    return int(np.clip(np.floor(lean / BAND) + len(EDGES) // 2, 0, len(EDGES) - 2))
