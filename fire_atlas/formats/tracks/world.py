"""Flakes in the axes of an engine's world: metres, x right, y up, z towards the viewer.

The frame stands upright, one metre high, on the origin: the middle of its bottom edge. An engine
scales it to the height it shows the effect at.
"""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import Tracks

AXES = "metres, x right, y up; one frame height is 1 m; origin: middle of the frame's bottom edge"

METRES = 6
"""Decimals of positions and sizes, m."""
SPEED = 5
"""Decimals of velocities, m/s."""


def place(tracks: Tracks, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return positions (n, 3), m, of x and y (n,), px of the frame with y down."""
    right, up = (x - tracks.width / 2) / tracks.height, 1 - y / tracks.height
    return np.column_stack([right, up, np.zeros_like(right)])


def velocity(
    tracks: Tracks, vx: NDArray[np.float64], vy: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return velocities (n, 3), m/s, of vx and vy (n,), px/s with y down."""
    return np.column_stack([vx, -vy, np.zeros_like(vx)]) / tracks.height
