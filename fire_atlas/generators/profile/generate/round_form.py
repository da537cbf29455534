"""The depth and normals of a generated fire: the front of the round column in which it burns.

A profile knows a fire from the front and from the side. At each height it burns in an ellipse, as
wide as the one view shows it and as deep as the other; flakes are born in the same column.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import FrontSurface
from fire_atlas.core.pixels import as_plane
from fire_atlas.generators.profile.generate.axis import BentAxis, FramePlaces

_LEAST = 1e-6
"""Least size of the column that is divided by, flame heights."""


@dataclass(frozen=True, slots=True)
class Column:
    """The round column in which a fire burns, at the nodes of its axis, flame heights.

    Attributes:
        half: (n,) half its width, as the camera sees it.
        middle: (n,) distance of its middle to the right of the axis.
        depth: (n,) half its depth.
        taper: (n,) its size, in that of its foot.
    """

    half: NDArray[np.float64]
    middle: NDArray[np.float64]
    depth: NDArray[np.float64]
    taper: NDArray[np.float64]


def column_front(
    column: Column, axis: BentAxis, places: FramePlaces, camera: Camera
) -> FrontSurface:
    """Return the front of a column.

    Args:
        column: The column.
        axis: The axis of the fire.
        places: Where in the fire the pixels lie.
        camera: The camera; its unit of length is the flame height.
    """
    step = float(axis.heights[1] - axis.heights[0])
    heights, aside = (
        places.full(coordinate).astype(np.float64) for coordinate in (places.heights, places.across)
    )

    def at(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return values (n,) of the nodes at each pixel, and how they change along the axis."""
        return axis.at(values, heights), axis.at(np.gradient(values, step), heights)

    half, half_slope = at(np.maximum(column.half, _LEAST))
    depth, depth_slope = at(np.maximum(column.depth, _LEAST))
    middle, middle_slope = at(column.middle)
    away, away_slope = at(axis.away)
    size, size_slope = at(column.taper)
    across = (aside - middle) / half
    across_slope = -(middle_slope + across * half_slope) / half
    # What seems to burn beside the column burns at its edge.
    front = np.sqrt(np.clip(size * size - across * across, 0, None))
    towards = front * depth - away
    across = np.clip(across, -size, size)
    # The ellipse is across² + front² = taper²; its gradient is the normal.
    front_slope = (away_slope - front * depth_slope) / depth
    along = across * across_slope + front * front_slope - size * size_slope
    turn, _ = at(axis.turn)
    cos, sin = np.cos(turn), np.sin(turn)
    right, up = across / half * cos + along * sin, along * cos - across / half * sin
    normal = np.stack([right, -up, front / depth], axis=-1)
    rows = (camera.origin[1] - (np.arange(camera.height) + 0.5))[:, None] / camera.scale
    level = (rows - axis.at(axis.away, heights) * math.sin(camera.elevation)) / math.cos(
        camera.elevation
    )
    return _tilted(towards * camera.scale, level * camera.scale, normal, camera)


def _tilted(
    depth: NDArray[np.float64],
    up: NDArray[np.float64],
    normal: NDArray[np.float64],
    camera: Camera,
) -> FrontSurface:
    """Return depths and normals of a level view as a camera sees them that looks down; ``up`` is
    how far above the ground each pixel is, px."""
    cos, sin = math.cos(camera.elevation), math.sin(camera.elevation)
    right, down, towards = np.moveaxis(normal, -1, 0)
    seen = np.stack([right, down * cos + towards * sin, towards * cos - down * sin], axis=-1)
    seen[..., 2] = np.maximum(seen[..., 2], 0)
    length = np.sqrt((seen * seen).sum(axis=-1, keepdims=True))
    level = np.array([0.0, 0.0, 1.0])
    unit = np.where(length > _LEAST, seen / np.maximum(length, _LEAST), level)
    return FrontSurface(as_plane(depth * cos + up * sin), as_plane(unit))
