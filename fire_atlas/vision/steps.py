"""Which of the steps between successive frames of a clip show the same drawing again.

Art that is animated on twos holds each drawing for two frames, and footage that was brought to a
higher rate has doubled frames. Compression and noise change such a frame a little.
"""

import numpy as np
from numpy.typing import NDArray

_LONGEST = 6
"""A drawing is held for at most this many frames; what stands still for longer is a pause."""

_HELD = 0.25
"""A step is held if it is shorter than this fraction of steps shortly before and after it."""


def median_step(lengths: NDArray[np.floating], closed: bool) -> float:
    """Return the median length of the steps that lead to another drawing; see ``held_steps``."""
    return float(np.median(lengths[~held_steps(lengths, closed)]))


def held_steps(lengths: NDArray[np.floating], closed: bool) -> NDArray[np.bool_]:
    """Return which steps only hold a drawing, (n,); at any parity, for any part of a clip.

    Such a step lies between longer ones, at most ``_LONGEST`` steps away. At an end of the clip one
    side is enough, if other drawings of the clip are held.

    Args:
        lengths: (n,) length of each step.
        closed: Whether the first step follows the last.
    """
    count = len(lengths)
    if count < 3:
        return np.zeros(count, np.bool_)
    at = np.arange(count)[:, None] + np.r_[-_LONGEST + 1 : 0, 1:_LONGEST]
    inside = np.full(at.shape, True) if closed else (at >= 0) & (at < count)
    around = np.where(inside, lengths[at % count], 0.0).reshape(count, 2, -1)
    is_short = lengths[:, None] < _HELD * around.max(axis=2)
    held = np.asarray(is_short.all(axis=1), np.bool_)
    if not held.any():
        return held
    ends = ~inside.reshape(around.shape).all(axis=2)
    return np.asarray((is_short | ends).all(axis=1) & is_short.any(axis=1))
