"""Random numbers: one independent stream for each use, so that the order of calls is irrelevant."""

from enum import IntEnum

import numpy as np


class RandomStream(IntEnum):
    """The uses of random numbers, each with a stream of its own.

    The value is part of the stream's key: a changed or reused one changes the outputs of builds.
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
    REPLACED_BY_BURSTS = 16
    FLICKER = 17
    LIGHT = 18
    LEANING_SETS = 21
    FEW_IMAGES = 22
    TEXTURE_CELLS = 23
    DEPTH = 24
    SCATTER_IN_DEPTH = 25
    HAZE = 26
    BURNERS = 27
    STIRRING = 28
    FINE_DETAIL = 29
    PHASES = 30
    ELSEWHERE = 31
    VARIANTS = 32
    FLAKE_SETS = 33


def generator(seed: int, stream: RandomStream, index: int = 0) -> np.random.Generator:
    """Return the random numbers (Philox) of the key (seed, stream, index).

    ``index`` is the number of a frame, a simulation tick or a view.
    """
    return np.random.Generator(np.random.Philox(key=[seed, (int(stream) << 48) | index]))


def seed_of(seed: int, stream: RandomStream, number: int) -> int:
    """Return the seed of one of several that are made with a ``seed``; number 0 has that itself."""
    return int(generator(seed, stream, number).integers(2**32)) if number else seed
