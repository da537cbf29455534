"""Which part of the clip is fetched when: the feature statistics learner's succession of frames.

Slices of the fire that lie near one another share a clock. A clock plays some of the clip
forwards, then goes on with another part of it, and so on; what is born after such a splice shows
the new part, what was born before rises and dies with the old one. So a splice is never seen at
once: it climbs through the flame with its gases.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.generators.profile.force import Weather
from fire_atlas.generators.profile.model import Side
from fire_atlas.generators.profile.states import LeaningSet, state_of

_SAME_RATE = 0.1
"""Rates that differ by less are taken for the same: frames then need not be blended."""


_KIN = 0.3
"""Frames of which neighbours have less in common than this are those of a cartoon."""

_SLOW = 0.7
"""A cartoon that plays this much slower than the result keeps its rhythm: frames are held."""


@dataclass(frozen=True, slots=True)
class Splice:
    """Some of the clip, played from some moment on.

    Attributes:
        start: Frame from which on what is born shows it.
        first: Frame of the clip shown at ``start``; clips that close go round.
        mirrored: Whether left and right change places.
        forced: Whether it was fetched for a force, which alone then says how the fire leans; what
            its frames lean by themselves is left out but for their quick sway.
    """

    start: int
    first: int
    mirrored: bool
    forced: bool


@dataclass(frozen=True, slots=True)
class Reel:
    """How frames of a clip become frames of the result.

    Attributes:
        rate: Frames of the clip per frame of the result.
        count: Frames of the clip.
        closed: Whether its first follows its last.
        holds: Whether a frame stays until the next: those of a cartoon have so little in common
            that what is between them is neither.
        life: Frames of the result for which anything lives.
        longest: Frames of the result from one splice to the next, at most.
    """

    rate: float
    count: int
    closed: bool
    holds: bool
    life: int
    longest: int

    @classmethod
    def of(cls, side: Side, fps: float, pace: float, life: float) -> "Reel":
        """Return how ``side`` is played at ``fps``, ``pace`` times as fast as it was filmed; what
        lives ``life`` s lives less if the clip is too short for it."""
        rate = side.fps / fps
        rate = pace * (1.0 if abs(rate - 1.0) < _SAME_RATE else rate)
        count = side.face.count
        frames = (count - 1) / rate
        holds = side.face.kinship < _KIN and rate < _SLOW
        if side.closed:
            return cls(rate, count, True, holds, max(round(life * fps), 2), max(int(frames), 2))
        # Of a clip that does not close, half of what a life leaves is played, from anywhere in it.
        lives = max(2, min(round(life * fps), int(0.4 * frames)))
        longest = max((int(frames) - lives) // 2, 1)
        return cls(rate, count, False, holds, lives, longest)

    def places(
        self, first: NDArray[np.intp], age: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
        """Two neighbouring frames of the clip and the share of the second, ``age`` frames after
        splices began with the frames ``first``; all of one shape."""
        at = first + age * self.rate
        if self.holds:
            at = np.floor(at)
        begun = np.floor(at)
        lower, part = begun.astype(np.intp), at - begun
        if self.closed:
            return lower % self.count, (lower + 1) % self.count, part
        lower = np.clip(lower, 0, self.count - 1)
        return lower, np.minimum(lower + 1, self.count - 1), part


def splices_of(
    side: Side, reel: Reel, period: int, weather: Weather, plane: float, seed: int, clock: int
) -> tuple[Splice, ...]:
    """Splices of one clock through ``period`` frames, in order; after the last the first comes.

    In still air they begin anywhere in the clip; under a force, among the frames of the leaning
    state it asks for.
    """
    chance = generator(seed, Stage.SPLICES, clock)
    number = max(2, math.ceil(period / (0.85 * reel.longest)))
    length = period / number
    shift = chance.random()
    # Each part of the clip comes once before any comes again, in a shuffled order.
    phase = chance.random()
    order = chance.permutation(number)
    jitter = chance.uniform(-0.07, 0.07, number) * length
    flips = chance.random(number) < 0.5
    splices = []
    for i in range(number):
        start = int((i + shift) * length + jitter[i]) % period
        asked = weather.state(start if start < len(weather.calm) else 0, plane)
        chosen = None if asked is None else _set(side, *asked)
        place = (float(order[i]) + phase) / number
        first, mirrored = _first(side, reel, chosen, place, bool(flips[i]))
        splices.append(Splice(start, first, mirrored, chosen is not None))
    return tuple(sorted(splices, key=lambda splice: splice.start))


def _set(side: Side, lean: float, period: str) -> LeaningSet:
    state = state_of(side.statistics.lean.median + lean)
    found = [each for each in side.sets if each.period == period]
    return found[state]


def _first(
    side: Side, reel: Reel, chosen: LeaningSet | None, place: float, flip: bool
) -> tuple[int, bool]:
    """Frame to begin with, at ``place`` (0..1) among those there are, and whether to mirror it."""
    last = reel.count - 1
    if not reel.closed:
        last = max(0, int(last - (reel.longest + reel.life) * reel.rate))
    if chosen is None:
        # Few frames are soon known by heart; mirrored they are others.
        return int(place * (last + 1)), flip and side.face.is_even
    frame = chosen.frames[int(place * len(chosen.frames))]
    return min(frame, last), chosen.origin == "mirrored"
