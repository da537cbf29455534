"""A plain rasteriser: for every triangle, every sample of its box is tested one by one."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def texel_at(texture: NDArray[np.float32], x: float, y: float) -> Array:
    """Bilinear, black outside."""
    height, width = texture.shape[:2]
    x0, y0 = math.floor(x), math.floor(y)
    total = np.zeros(texture.shape[2])
    for j, wy in ((y0, 1 - (y - y0)), (y0 + 1, y - y0)):
        for i, wx in ((x0, 1 - (x - x0)), (x0 + 1, x - x0)):
            if 0 <= i < width and 0 <= j < height:
                total += wx * wy * texture[j, i]
    return total


def draw(
    corners: Array, values: Array, texture: NDArray[np.float32], width: int, height: int
) -> tuple[Array, NDArray[np.bool_]]:
    """Sum of all triangles: light (height, width, 3), and which samples are near an edge.

    Args:
        corners: (n, 3, 2) px.
        values: (n, 3, 5): texel x and y, and how much of each channel shows.
        texture: (h, w, 3).
        width, height: Of the target, px.
    """
    light, near_edge = np.zeros((height, width, 3)), np.zeros((height, width), bool)
    for place, value in zip(corners, values, strict=True):
        (ax, ay), (bx, by), (cx, cy) = place
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0:
            continue
        for row in range(max(math.floor(place[:, 1].min()), 0), height):
            y = row + 0.5
            if y > place[:, 1].max() + 1:
                break
            for column in range(max(math.floor(place[:, 0].min()), 0), width):
                x = column + 0.5
                if x > place[:, 0].max() + 1:
                    break
                a = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
                b = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
                weights = a, b, 1 - a - b
                lowest = min(weights)
                if abs(lowest) < 1e-6:
                    near_edge[row, column] = True
                if lowest >= 0:
                    u, v, *shows = sum(w * one for w, one in zip(weights, value, strict=True))
                    light[row, column] += texel_at(texture, u, v) * shows
    return light, near_edge
