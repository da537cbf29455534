"""The front of a fire that consists of points: where it is, and which way it faces.

Sheets are thin, but the fire that they stand for is not. So their points become a density on a grid
along the lines of sight, blurred until sheets that stand close together are one body. The front of
a line of sight is where it has passed little of its density; the normal is the direction in which
the density falls there (as volumes are shaded: Drebin, Carpenter & Hanrahan 1988).
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.clip import FrontSurface
from fire_atlas.core.pixels import as_plane
from fire_atlas.vision.warp import sample_at

_ROWS = 128
"""Maximum rows of the grid."""

POINT_DISTANCE = 0.5 / _ROWS
"""Distance of points that fill a surface on the grid, frame heights."""

_MAX_LAYERS = 256
"""Maximum layers of the grid along the lines of sight; deeper fires have thicker ones."""

_BLUR = 0.022
"""Standard deviation of the blur, frame heights: sheets nearer to one another are one body."""

_FRONT = 12.0
"""Optical depth of the whole density of a line of sight: what lies behind the first part of it has
little part in its front."""

_DILATION = 1.1
"""Distance by which the blur moves the front of a body outwards, standard deviations."""

_STEPS = 4
"""Number of steps in which the places of fronts before the blur are found."""

_GRID_MARGIN = 4.0
"""Distance around the points that the grid holds, standard deviations of the blur."""

_FALLING = np.array([-1, -1, 1], np.float32)
"""Signs that turn how density grows right, down and away into how it falls towards the viewer."""

_EMPTY = 1e-2
"""Density of a line of sight, of the frame's densest, below which it has no front of its own."""

_SPREAD = 4.0
"""Standard deviation, in blurs, with which fronts are continued where there is no fire."""


_REACH = 0.5
"""Distance beyond the sides of a tile that has a part in its front, frame heights."""

_LEVEL = 0.02
"""Weight of a level front, where others are continued."""

_SOFTENING = 0.5
"""Standard deviation of the blur of fronts at last, in what the body was shrunk by."""


@dataclass(frozen=True, slots=True)
class PointCloud:
    """Points of a fire, as a camera sees them.

    Attributes:
        place: (n, 3) px right, px down, px towards the viewer.
        weight: (n,) the fire that each stands for.
    """

    place: NDArray[np.float64]
    weight: NDArray[np.float64]

    @classmethod
    def seen_by(
        cls, camera: Camera, points: NDArray[np.float64], weight: NDArray[np.float64]
    ) -> Self:
        """Return points (..., 3) of the world, of ``weight`` (...), as ``camera`` sees them."""
        place = camera.project(points).reshape(-1, 3)
        place[:, 2] *= -camera.scale
        return cls(place, np.asarray(weight, np.float64).reshape(-1))


@dataclass(frozen=True, slots=True)
class _Grid:
    """Density along the lines of sight.

    Attributes:
        density: (rows, columns, layers), the layers from the nearest on.
        cell: Size of a cell along rows, columns and layers, px.
        nearest: Where the first layer begins, px towards the viewer.
    """

    density: NDArray[np.float32]
    cell: tuple[float, float, float]
    nearest: float

    def depths(self) -> NDArray[np.float32]:
        """Return the depth of each layer's middle, (layers,) px towards the viewer."""
        layers = np.arange(self.density.shape[2]) + 0.5
        return as_plane(self.nearest - layers * self.cell[2])


def front_surface_of(points: PointCloud, camera: Camera) -> tuple[FrontSurface, NDArray[np.bool_]]:
    """Return the front of a fire in a frame of ``camera``, and the pixels (height, width) it fills.

    Around it the front is continued, until it is level, at depth 0.
    """
    if camera.tiles:
        return _front_of_tile(points, camera)
    grid = _density(points, camera)
    total = grid.density.sum(axis=2)
    if not total.any():
        return FrontSurface.flat(camera.height, camera.width), np.zeros(
            (camera.height, camera.width), bool
        )
    is_fire = total > _EMPTY * total.max()
    whole = _shrunk(_continued(_fronts(grid, total), is_fire, grid, camera), grid, camera)
    size = camera.width, camera.height
    shown = cv2.resize(as_plane(np.dstack([whole, is_fire])), size, interpolation=cv2.INTER_LINEAR)
    return FrontSurface(as_plane(shown[..., 3]), _unit(as_plane(shown[..., :3]))), shown[
        ..., 4
    ] > 0.5


def _front_of_tile(points: PointCloud, camera: Camera) -> tuple[FrontSurface, NDArray[np.bool_]]:
    """Return the front of a fire whose frame lies between copies of itself."""
    width, margin = camera.width, math.ceil(_REACH * camera.height)
    around = replace(camera, width=width + 2 * margin, tiles=False)
    first = np.mod(points.place[:, 0] + margin, width)
    copies = -(-around.width // width)
    place = np.tile(points.place, (copies, 1))
    place[:, 0] = (first + width * np.arange(copies)[:, None]).ravel()
    surface, is_fire = front_surface_of(PointCloud(place, np.tile(points.weight, copies)), around)
    own = slice(margin, margin + width)
    return FrontSurface(surface.depth[:, own], surface.normal[:, own]), is_fire[:, own]


def _fronts(grid: _Grid, total: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return normal and depth (rows, columns, 4) of the front of each line of sight, whose density
    is ``total`` (rows, columns) in all."""
    least = np.float32(1e-30)
    passed = np.cumsum(grid.density, axis=2) - grid.density / 2
    visible = np.exp(np.float32(-_FRONT) * (passed / np.maximum(total, least)[..., None]))
    seen = visible * grid.density
    depth = (seen @ grid.depths()) / np.maximum(seen.sum(axis=2), least)
    down, right, away = np.gradient(grid.density, *grid.cell)
    slopes = np.stack([(visible * slope).sum(axis=2) for slope in (right, down, away)], axis=-1)
    return as_plane(np.dstack([_unit(as_plane(slopes * _FALLING)), depth]))


def _density(points: PointCloud, camera: Camera) -> _Grid:
    """Return the density of points on a grid of at most ``_ROWS`` rows."""
    from scipy.ndimage import gaussian_filter  # only normals need it, and it is slow to import

    rows = min(camera.height, _ROWS)
    down, blur = camera.height / rows, _BLUR * camera.height
    columns = max(1, round(camera.width / down))
    has_light = points.weight > 0
    place, weight = points.place[has_light], points.weight[has_light]
    far, near = (place[:, 2].min(), place[:, 2].max()) if has_light.any() else (0.0, 0.0)
    thickness = float(near - far) + 2 * _GRID_MARGIN * blur
    away = max(down, thickness / _MAX_LAYERS)
    nearest = float(near) + _GRID_MARGIN * blur
    shape = rows, columns, math.ceil(thickness / away)
    cell = down, camera.width / columns, away
    along = np.stack([place[:, 1], place[:, 0], nearest - place[:, 2]], axis=1)
    counted = _counted(np.floor(along / cell).astype(np.intp), weight, shape)
    blurred = gaussian_filter(counted, [blur / side for side in cell], mode="constant")
    return _Grid(as_plane(blurred), cell, nearest)


def _counted(
    index: NDArray[np.intp], weight: NDArray[np.float64], shape: tuple[int, int, int]
) -> NDArray[np.float32]:
    """Return the sum of weights (n,) in each cell of a grid, by index (n, 3)."""
    inside = ((index >= 0) & (index < shape)).all(axis=1)
    flat = np.ravel_multi_index(tuple(index[inside].T), shape)
    sums = np.bincount(flat, weights=weight[inside], minlength=math.prod(shape))
    return as_plane(sums).reshape(shape)


def _continued(
    fronts: NDArray[np.float32], is_fire: NDArray[np.bool_], grid: _Grid, camera: Camera
) -> NDArray[np.float32]:
    """Return normals and depths (rows, columns, 4), continued from the fire to where none is."""
    sigma = _SPREAD * _BLUR * camera.height / grid.cell[0]
    weighted = as_plane(np.dstack([fronts, np.ones_like(is_fire)]) * is_fire[..., None])
    near = cv2.GaussianBlur(weighted, (0, 0), sigma)
    level = np.array([0, 0, _LEVEL, 0], np.float32)
    around = (near[..., :4] + level) / (near[..., 4:] + np.float32(_LEVEL))
    return as_plane(np.where(is_fire[..., None], fronts, around))


def _shrunk(fronts: NDArray[np.float32], grid: _Grid, camera: Camera) -> NDArray[np.float32]:
    """Return normals and depths (rows, columns, 4) of the body before it was blurred, which made it
    wider all around: each front is where it was seen, less that much along its normal."""
    wider = _DILATION * _BLUR * camera.height
    row, column = np.indices(fronts.shape[:2], np.float32)
    moved = fronts
    for _ in range(_STEPS):
        at = (
            column + moved[..., 0] * wider / grid.cell[1],
            row + moved[..., 1] * wider / grid.cell[0],
        )
        moved = sample_at(fronts, as_plane(at[0]), as_plane(at[1]))
    depth = moved[..., 3] - moved[..., 2] * wider
    sharp = as_plane(np.dstack([moved[..., :3], depth]))
    # Wisps that are thinner than the blur would be folded.
    return as_plane(cv2.GaussianBlur(sharp, (0, 0), _SOFTENING * wider / grid.cell[0]))


def _unit(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return vectors (..., 3) at length 1, towards the viewer."""
    vectors = np.dstack([vectors[..., :2], np.maximum(vectors[..., 2], 0)])
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    level = np.array([0, 0, 1], np.float32)
    return as_plane(np.where(length > 0, vectors / np.maximum(length, np.float32(1e-30)), level))
