"""Easing curves: smooth transitions between two values."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Real = TypeVar("Real", np.float32, np.float64)


def smooth_step(share: NDArray[Real]) -> NDArray[Real]:
    """Return the smooth step 3 x² − 2 x³, where x is ``share`` clipped to 0..1; any shape."""
    x = np.clip(share, 0, 1)
    return x * x * (3 - 2 * x)


def edge_fade(length: int, edge: float) -> NDArray[np.float32]:
    """Return weights (length,), 0 at both ends and 1 from ``edge`` samples on."""
    from_end = np.minimum(np.arange(length), np.arange(length)[::-1]) / max(edge, 1.0)
    return smooth_step(from_end).astype(np.float32)
