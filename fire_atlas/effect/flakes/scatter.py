"""Jitter of flake directions (Kim & Lee, eq. 13)."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator

_SLOTS = 1 << 13
"""Angles drawn for a tick. Flakes whose ids are so far apart share one: nobody can see that."""


def scattering_cosine(xi: NDArray[np.float64], k: float) -> NDArray[np.float64]:
    """cosθ = (2ξ + k − 1)/(2kξ − k + 1) of eq. 13, for uniform ξ in [0, 1).

    k = 0 scatters isotropically (cosθ uniform), k > 0 forward, k < 0 backward. At k = ±1, where
    the formula can be 0/0, its limit is taken: cosθ = ±1.
    """
    if abs(k) == 1.0:
        return np.full_like(xi, k)
    return np.clip((2 * xi + k - 1) / (2 * k * xi - k + 1), -1.0, 1.0)


def scatter_turns(
    seed: int, tick: int, ids: NDArray[np.int64], k: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """cosθ and sinθ of the angle by which each flake of ``ids`` turns at ``tick``; its sign is
    random.

    A flake's turn depends on (seed, tick, id) alone, not on which others are alive.
    """
    if k == 1.0 or not len(ids):
        return np.ones(len(ids)), np.zeros(len(ids))
    # The first draws do not depend on how many follow.
    slots = min(int(ids.max()) + 1, _SLOTS)
    draws = 2 * generator(seed, Stage.SCATTER, tick).random(slots).take(ids & (_SLOTS - 1))
    # One draw serves both: its upper half is the turn to the right, its lower to the left.
    right = np.floor(draws)
    cos = scattering_cosine(draws - right, k)
    return cos, (2 * right - 1) * np.sqrt(1 - cos * cos)
