"""From the pixels of a frame to what they do to the air on the grid."""

from dataclasses import fields

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.effect.field.air import grid_shape
from fire_atlas.effect.field.buoyancy import Drive


def cell_means(plane: Plane, cell: int) -> Plane:
    """Mean of each ``cell`` by ``cell`` block of a (H, W) plane; border cells repeat the border."""
    height, width = plane.shape
    rows, columns = grid_shape(width, height, cell)
    padded = cv2.copyMakeBorder(
        plane, 0, rows * cell - height, 0, columns * cell - width, cv2.BORDER_REPLICATE
    )
    return as_plane(cv2.resize(padded, (columns, rows), interpolation=cv2.INTER_AREA))


def rising(u: Plane, v: Plane, direction: tuple[float, float]) -> tuple[Plane, Plane]:
    """Flow (any unit) whose part against ``direction``, a unit vector, is only half as fast.

    Where a tongue burns out its outline falls back, and the eye with it; its gas still rises.
    """
    x, y = (np.float32(c) for c in direction)
    against = np.minimum(u * x + v * y, 0.0) * np.float32(0.5)
    return as_plane(u - against * x), as_plane(v - against * y)


def flow_on_grid(
    flow: NDArray[np.float32], mask: Plane, size: tuple[int, int], cell: int, fps: float
) -> tuple[Plane, Plane]:
    """Optical flow of the flame at the centres of the grid's cells, px/s.

    Only the flame's own flow counts: the estimate outside it is noise.

    Args:
        flow: (h, w, 2), px of the thumbnail a frame.
        mask: (H, W), how surely each pixel of the frame is flame.
        size: (width, height) of the frame, px.
        cell: px.
        fps: Frames per second.
    """
    width, height = size
    thumb_height, thumb_width = flow.shape[:2]
    scale_x, scale_y = thumb_width / width, thumb_height / height
    weight = as_plane(
        cv2.resize(mask, (thumb_width, thumb_height), interpolation=cv2.INTER_AREA)
    ) + np.float32(1e-4)
    reach = max(1, round(cell * scale_x)), max(1, round(cell * scale_y))
    u, v = cv2.split(flow)
    near = cv2.blur(
        cv2.merge((u * weight, v * weight, weight)), reach, borderType=cv2.BORDER_REPLICATE
    )
    rows, columns = grid_shape(width, height, cell)
    step_x, step_y = cell * scale_x, cell * scale_y
    centres = np.array([[step_x, 0, (step_x - 1) / 2], [0, step_y, (step_y - 1) / 2]])
    u, v, total = cv2.split(
        cv2.warpAffine(
            near, centres, (columns, rows), borderMode=cv2.BORDER_REPLICATE,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
    )  # fmt: skip
    return (
        as_plane(u / total * np.float32(fps / scale_x)),
        as_plane(v / total * np.float32(fps / scale_y)),
    )


def on_whole_grid(drive: Drive, window: Window, size: tuple[int, int], cell: int) -> Drive:
    """Return the drive of a part of the frame as one of the whole grid, with still surroundings.

    Args:
        drive: Of the cells in the window.
        window: The part, on multiples of ``cell`` px.
        size: Width and height of the frame, px.
        cell: Side of a cell, px.
    """
    shape = grid_shape(*size, cell)
    row, column = window.top // cell, window.left // cell

    def placed(plane: Plane) -> Plane:
        whole = np.zeros(shape, np.float32)
        whole[row : row + plane.shape[0], column : column + plane.shape[1]] = plane
        return whole

    return Drive(*(placed(getattr(drive, field.name)) for field in fields(drive)))
