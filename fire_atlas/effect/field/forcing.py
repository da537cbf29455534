"""Forcing: how each frame of the clip drives the buoyancy field, on the field's grid (eq. 12).

One cell of the grid covers ``cell`` by ``cell`` px; cell (row i, column j) is centred on
((j + 0.5) cell, (i + 0.5) cell) px. Velocities are px/s, x right, y down.
"""

import math
from dataclasses import dataclass, fields

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.pixels import Plane, as_plane


@dataclass(frozen=True, slots=True)
class Forcing:
    """One frame's input to the body forces U_buoyancy. All planes (rows, columns) float32.

    Attributes:
        flame: Fraction of each cell that is flame, 0..1.
        brightness: Of each cell, 0..1, flame or not.
        flow_x, flow_y: Optical flow of the flame in each cell, px/s; 0 if features drive the field.
        feature_x, feature_y: Mean Fv* of each cell (eq. 3), in units of the clip's mean ‖∇f‖; 0 if
            the flow drives it.
    """

    flame: Plane
    brightness: Plane
    flow_x: Plane
    flow_y: Plane
    feature_x: Plane
    feature_y: Plane

    def padded(self, window: Window, size: tuple[int, int], cell: int) -> "Forcing":
        """Return the forcing of a window of the frame on the whole frame's grid, zero elsewhere."""
        planes = (getattr(self, field.name) for field in fields(self))
        return Forcing(*(padded_to_grid(plane, window, size, cell) for plane in planes))


def grid_shape(width: int, height: int, cell: int) -> tuple[int, int]:
    """Rows and columns of the grid that covers a ``width`` by ``height`` px frame."""
    return math.ceil(height / cell), math.ceil(width / cell)


def cell_means(plane: Plane, cell: int) -> Plane:
    """Mean of each ``cell`` by ``cell`` block of a (H, W) plane, extended by its border values."""
    height, width = plane.shape
    rows, columns = grid_shape(width, height, cell)
    padded = cv2.copyMakeBorder(
        plane, 0, rows * cell - height, 0, columns * cell - width, cv2.BORDER_REPLICATE
    )
    return as_plane(cv2.resize(padded, (columns, rows), interpolation=cv2.INTER_AREA))


def halve_descent(u: Plane, v: Plane, direction: tuple[float, float]) -> tuple[Plane, Plane]:
    """Halve the part of a flow (any unit) that goes against ``direction``, a unit vector.

    A tip that burns out looks like downward flow although the hot gas keeps rising.
    """
    x, y = (np.float32(c) for c in direction)
    against = np.minimum(u * x + v * y, 0.0) * np.float32(0.5)
    return as_plane(u - against * x), as_plane(v - against * y)


def flow_on_grid(
    flow: NDArray[np.float32], mask: Plane, size: tuple[int, int], cell: int, fps: float
) -> tuple[Plane, Plane]:
    """Optical flow of the flame at the centres of the grid's cells: u and v, px/s.

    Pixels are weighted by the flame's mask: outside the flame the estimate is noise.

    Args:
        flow: (h, w, 2), thumbnail px per frame.
        mask: (H, W), confidence 0..1 that each pixel of the frame is flame.
        size: (width, height) of the frame, px.
        cell: Side of a cell, px.
        fps: Frames per second.
    """
    width, height = size
    thumb_height, thumb_width = flow.shape[:2]
    scale_x, scale_y = thumb_width / width, thumb_height / height
    weight = as_plane(
        cv2.resize(mask, (thumb_width, thumb_height), interpolation=cv2.INTER_AREA)
    ) + np.float32(1e-4)
    window = max(1, round(cell * scale_x)), max(1, round(cell * scale_y))
    u, v = cv2.split(flow)
    weighted = cv2.blur(
        cv2.merge((u * weight, v * weight, weight)), window, borderType=cv2.BORDER_REPLICATE
    )
    rows, columns = grid_shape(width, height, cell)
    step_x, step_y = cell * scale_x, cell * scale_y
    centres = np.array([[step_x, 0, (step_x - 1) / 2], [0, step_y, (step_y - 1) / 2]])
    u, v, total = cv2.split(
        cv2.warpAffine(
            weighted, centres, (columns, rows), borderMode=cv2.BORDER_REPLICATE,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
    )  # fmt: skip
    return (
        as_plane(u / total * np.float32(fps / scale_x)),
        as_plane(v / total * np.float32(fps / scale_y)),
    )


def padded_to_grid(plane: Plane, window: Window, size: tuple[int, int], cell: int) -> Plane:
    """Place a plane of a window of the frame on the whole frame's grid, zero elsewhere.

    The edges of ``window`` are multiples of ``cell`` px; ``size`` is the frame's (width, height).
    """
    row, column = window.top // cell, window.left // cell
    whole = np.zeros(grid_shape(*size, cell), np.float32)
    whole[row : row + plane.shape[0], column : column + plane.shape[1]] = plane
    return whole
