"""Random numbers: one counter-based stream for each use, the same in any order of calls."""

from enum import IntEnum

import numpy as np


class Stage(IntEnum):
    """What a stream of random numbers is used for.

    Its value is part of the key, and so of every result: never reuse one.
    """

    EMISSION = 1
    SCATTER = 2
    EDDIES = 3
    BURSTS = 4
    PACKING = 5
    PARTICLES = 6
    SPLICES = 7
    PLUME = 10
    SHEETS = 11
    TURBULENCE = 12
    EXCITEMENT = 13
    THINNING = 14
    TRICKLE = 15


def generator(seed: int, stage: Stage, index: int = 0) -> np.random.Generator:
    """Return the random stream (Philox) with the key (seed, stage, index).

    ``index`` is that of a frame, tick or view.
    """
    return np.random.Generator(np.random.Philox(key=[seed, (int(stage) << 48) | index]))
