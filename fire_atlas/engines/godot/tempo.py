"""How long frames are shown: Godot counts in ticks of an animation's own speed."""

from collections.abc import Sequence
from fractions import Fraction
from math import gcd, lcm
from typing import NamedTuple

_FINEST = 64
"""Largest denominator of a frame's length in lengths of the shortest."""


class Tempo(NamedTuple):
    """Speed of an animation, ticks per second, and how many ticks each of its frames is shown."""

    speed: float
    ticks: tuple[float, ...]


def tempo(durations: Sequence[float]) -> Tempo:
    """Return the tempo of frames that last so many ms: the shortest lasts one tick."""
    shortest = min(durations)
    ticks = (round(duration / shortest, 6) for duration in durations)
    return Tempo(round(1000 / shortest, 6), tuple(ticks))


def whole_tempo(durations: Sequence[float]) -> Tempo:
    """Return the tempo in whole ticks, for an engine that knows no other: as few as can be."""
    speed, ticks = tempo(durations)
    parts = [Fraction(tick).limit_denominator(_FINEST) for tick in ticks]
    finer = lcm(*(part.denominator for part in parts))
    counts = [int(part * finer) for part in parts]
    coarser = gcd(*counts)
    return Tempo(
        round(speed * finer / coarser, 6), tuple(float(count // coarser) for count in counts)
    )
