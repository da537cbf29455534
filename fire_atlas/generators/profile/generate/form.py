"""The form of a generated fire: the front of the round column in which it burns.

A profile knows a fire from the front and from the side. At each height it burns in an ellipse, as
wide as the one view shows it and as deep as the other; flakes are born in the same column.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import Form
from fire_atlas.core.pixels import as_plane

_LEAST = 1e-6
"""Least size of the column that is divided by, flame heights."""


@dataclass(frozen=True, slots=True)
class ColumnSide:
    """One side of the column, by the rows of the frame.

    Attributes:
        half: (rows,) half its width, flame heights.
        middle: (rows,) its middle, flame heights to the right of the axis.
    """

    half: NDArray[np.float64]
    middle: NDArray[np.float64]


def column_form(
    seen: ColumnSide, deep: ColumnSide, taper: NDArray[np.float64], camera: Camera
) -> Form:
    """Return the form of a column.

    ``seen`` is what the camera sees of it, ``deep`` what one sees from the right, ``taper`` (rows,)
    its size, in that of its foot. The camera's unit of length is the flame height.
    """
    right = (np.arange(camera.width) + 0.5 - camera.origin[0]) / camera.scale
    half, depth = (np.maximum(side.half, _LEAST)[:, None] for side in (seen, deep))
    across = (right - seen.middle[:, None]) / half
    size = taper[:, None]
    # What seems to burn beside the column burns at its edge.
    front = np.sqrt(np.clip(size * size - across * across, 0, None))
    towards = front * depth - deep.middle[:, None]
    across = np.clip(across, -size, size)
    # The ellipse is across² + front² = taper²; its gradient is the normal.
    step = 1 / camera.scale / math.cos(camera.elevation)
    shift = _fall(deep.middle[:, None], step) - front * _fall(depth, step)
    down = across * _fall(across, step) + front * shift / depth - size * _fall(size, step)
    normal = np.stack([across / half, down, front / depth], axis=-1)
    return _tilted(towards * camera.scale, normal, camera)


def _fall(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return how values (rows, ...) change per flame height down; rows are a ``step`` apart."""
    return np.asarray(np.gradient(values, step, axis=0))


def _tilted(depth: NDArray[np.float64], normal: NDArray[np.float64], camera: Camera) -> Form:
    """Return depths and normals of a level view as a camera sees them that looks down."""
    cos, sin = math.cos(camera.elevation), math.sin(camera.elevation)
    up = (camera.origin[1] - (np.arange(camera.height) + 0.5))[:, None] / cos
    right, down, towards = np.moveaxis(normal, -1, 0)
    seen = np.stack([right, down * cos + towards * sin, towards * cos - down * sin], axis=-1)
    seen[..., 2] = np.maximum(seen[..., 2], 0)
    length = np.sqrt((seen * seen).sum(axis=-1, keepdims=True))
    level = np.array([0.0, 0.0, 1.0])
    unit = np.where(length > _LEAST, seen / np.maximum(length, _LEAST), level)
    return Form(as_plane(depth * cos + up * sin), as_plane(unit))
