"""Passing softly from one thing to another."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Real = TypeVar("Real", np.float32, np.float64)


def smooth_step(share: NDArray[Real]) -> NDArray[Real]:
    """Return 0 up to ``share`` 0, 1 from 1 on, and 3 x² − 2 x³ in between; any shape."""
    x = np.clip(share, 0, 1)
    return x * x * (3 - 2 * x)
