"""Carry fields with the gas: the scheme of MacCormack, limited.

After A. Selle, R. Fedkiw, B. Kim, Y. Liu and J. Rossignac, "An Unconditionally Stable MacCormack
Method" (2008): φ* = A(φ), carried; φ° = A⁻¹(φ*), carried back; φ' = φ* + (φ − φ°) / 2, held between
the least and the greatest of the eight cubes that φ* was read from. The way back to where gas comes
from is traced with the velocity half way (midpoint rule), so the scheme is of second order.
"""

from typing import NamedTuple

import cv2
import numpy as np

from fire_atlas.core.pixels import as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.grid import Field, FluidGrid
from fire_atlas.vision.warp import sample_at

_CORNERS = np.ones((2, 2), np.uint8)

_NEAREST = cv2.INTER_NEAREST


class _Places(NamedTuple):
    """Places in a grid that are looked up, as an image in which layers lie below one another.

    Attributes:
        layers: The layers of that image.
        x, y: (n, columns) column and row in it of the nearer of the two layers around each place.
        share: (n, columns, 1) part of the farther one.
    """

    layers: slice
    x: Field
    y: Field
    share: Field


class Carried(NamedTuple):
    """Two fields of four channels, carried by one flow."""

    velocity: Field
    scalars: Field


def places(grid: FluidGrid, x: Field, y: Field, z: Field) -> _Places:
    """Return places at columns, rows and layers x, y, z, each (n, rows, columns), held inside."""
    layers, rows, columns = grid.shape
    x, y, z = (
        np.minimum(np.maximum(at, 0), np.float32(length - 1))
        for at, length in ((x, columns), (y, rows), (z, layers))
    )
    near = np.minimum(np.floor(z), np.float32(layers - 2))
    first, last = int(near.min()), int(near.max()) + 2
    width = x.shape[-1]
    return _Places(
        slice(first, last),
        as_plane(x).reshape(-1, width),
        as_plane(y + (near - np.float32(first)) * np.float32(rows)).reshape(-1, width),
        as_plane(z - near).reshape(-1, width, 1),
    )


def look_up(field: Field, at: _Places) -> Field:
    """Return the trilinear values of a field of four channels at places, (n, columns, 4)."""
    image = field[at.layers].reshape(-1, *field.shape[2:])
    near = sample_at(image, at.x, at.y)
    far = sample_at(image, at.x, at.y + np.float32(field.shape[1]))
    far -= near
    far *= at.share
    near += far
    return near


def mac_cormack(
    grid: FluidGrid, carried: Carried, wind: Field, dt: float, sharpness: Carried, workers: Workers
) -> Carried:
    """Return both fields after ``dt`` s in the flow of ``carried.velocity`` and the ``wind``.

    Args:
        grid: Their grid.
        carried: The fields.
        wind: (rows, 4) velocity of the air that is no part of the field, heights/s.
        dt: Time step, s.
        sharpness: Part of the blur of a look-up that is undone, for each channel of both fields,
            (4,) each: up to 0.5, which is the scheme's.
        workers: Threads for the slabs.
    """
    _, rows, columns = grid.shape
    cubes = np.float32(dt / grid.cell)
    x = np.arange(columns, dtype=np.float32)
    y = np.arange(rows, dtype=np.float32)[:, None]
    moved = Carried(np.empty_like(carried.velocity), np.empty_like(carried.scalars))
    results = Carried(np.empty_like(carried.velocity), np.empty_like(carried.scalars))
    blown = wind[None, :, None, :]

    def from_offset(part: slice, offset: Field, sign: float) -> _Places:
        """Return the places at an offset (n, rows, columns, 4), cubes, from a slab."""
        away = np.arange(part.start, part.stop, dtype=np.float32)[:, None, None]
        right, down, back = (offset[..., k] * np.float32(sign) for k in range(3))
        return places(grid, x + right, y + down, away + back)

    def there(part: slice) -> tuple[Field, _Places]:
        half = (carried.velocity[part] + blown) * (cubes * np.float32(0.5))
        middle = look_up(carried.velocity, from_offset(part, half, -1)).reshape(half.shape)
        offset = (middle + blown) * cubes
        origin = from_offset(part, offset, -1)
        for field, result in zip(carried, moved, strict=True):
            result[part] = look_up(field, origin).reshape(half.shape)
        return offset, origin

    traced = dict(
        zip((part.start for part in grid.slabs()), grid.each_slab(workers, there), strict=True)
    )

    def back(part: slice) -> None:
        offset, origin = traced.pop(part.start)
        # The way on from here has its own velocity half way: u(x + ½) = 2 u(x) − u(x − ½).
        ahead = (carried.velocity[part] + blown) * (2 * cubes) - offset
        returned = from_offset(part, ahead, 1)
        shape = offset.shape
        corner_y = np.floor(origin.y)
        for field, once, amount, result in zip(carried, moved, sharpness, results, strict=True):
            value = field[part] - look_up(once, returned).reshape(shape)
            value *= amount
            value += once[part]
            least, greatest = _corners(field[origin.layers], origin, corner_y)
            np.maximum(value, least.reshape(shape), out=value)
            np.minimum(value, greatest.reshape(shape), out=value)
            result[part] = value

    grid.each_slab(workers, back)
    return results


def _corners(layers: Field, at: _Places, corner_y: Field) -> tuple[Field, Field]:
    """Return the least and the greatest of the eight cubes around places, (n, columns, 4) each."""
    count, rows, columns, _ = layers.shape
    image = layers.reshape(count * rows, columns, 4)
    corner_x = np.floor(at.x)
    found = []
    for extreme, pick in ((cv2.erode, np.minimum), (cv2.dilate, np.maximum)):
        # Of a cube with those right of and below it, and of those behind.
        four = extreme(image, _CORNERS, anchor=(0, 0)).reshape(layers.shape)
        eight = pick(four[:-1], four[1:]).reshape(-1, columns, 4)
        found.append(sample_at(eight, corner_x, corner_y, _NEAREST))
    return found[0], found[1]
