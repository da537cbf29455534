"""The state of the air on the grid, and the steps that change it (Kim & Lee, eq. 12).

One cell covers ``cell`` by ``cell`` px; cell (row i, column j) is centred on
((j + 0.5) cell, (i + 0.5) cell) px. Velocities are px/s, x right, y down.
Every step is a pure function and stable for any time step and any force.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from fire_atlas.core.pixels import Plane, as_plane


@dataclass(frozen=True, slots=True)
class Air:
    """Moving, hot air on the grid.

    Attributes:
        u, v: (rows, columns) float32 velocity, px/s.
        heat: (rows, columns) float32, 1 in the flame, 0 in still cold air.
    """

    u: Plane
    v: Plane
    heat: Plane


def grid_shape(width: int, height: int, cell: int) -> tuple[int, int]:
    """Rows and columns of the grid that covers a ``width`` by ``height`` px frame."""
    return math.ceil(height / cell), math.ceil(width / cell)


def still_air(shape: tuple[int, int]) -> Air:
    """Air that does not move."""
    zero = np.zeros(shape, np.float32)
    return Air(zero, zero, zero)


def advect(air: Air, dt: float, cell: int) -> Air:
    """Semi-Lagrangian self-advection over ``dt`` seconds: (u·∇)u of eq. 12.

    Each plane is sampled on its own: OpenCV rounds the maps of two-channel data to 1/32 px, which
    would stop slow air altogether.
    """
    rows, columns = air.u.shape
    x, y = np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32)[:, None]
    # Beyond the frame the border value holds, so a longer way back changes nothing.
    reach = float(2 * max(rows, columns))
    from_x = x - np.clip(air.u * np.float32(dt / cell), -reach, reach)
    from_y = y - np.clip(air.v * np.float32(dt / cell), -reach, reach)
    return Air(*(_sample(plane, from_x, from_y) for plane in (air.u, air.v, air.heat)))


def diffuse(air: Air, viscosity: float, dt: float, cell: int) -> Air:
    """Viscosity over ``dt`` seconds, by the exact solution of the heat equation: a Gaussian.

    Args:
        air: State.
        viscosity: μ, px²/s.
        dt: s.
        cell: px.
    """
    sigma = min(math.sqrt(2 * viscosity * dt) / cell, max(air.u.shape))
    if sigma < 0.05:  # the kernel is a single tap
        return air
    size = 2 * math.ceil(3 * sigma) + 1
    return Air(
        *(
            as_plane(cv2.GaussianBlur(p, (size, size), sigma, borderType=cv2.BORDER_REPLICATE))
            for p in (air.u, air.v, air.heat)
        )
    )


def gain(rate: Plane, dt: float) -> Plane:
    """Seconds for which the slope of dw/dt = force + rate (target − w) has acted after ``dt``.

    w(dt) = w + (force + rate (target − w)) · gain is the exact solution; ``rate``: 1/s, >= 0.
    """
    exponent = rate * np.float32(dt)
    # (1 − e^−x)/x, whose limit at 0 is 1.
    share = np.where(exponent > 1e-6, -np.expm1(-exponent) / np.maximum(exponent, 1e-6), 1.0)
    return as_plane(share * np.float32(dt))


def _sample(plane: Plane, x: Plane, y: Plane) -> Plane:
    return as_plane(cv2.remap(plane, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
