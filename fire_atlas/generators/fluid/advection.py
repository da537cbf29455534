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

_NEAREST = cv2.INTER_NEAREST


class _Places(NamedTuple):
    """Places in a grid that are looked up, as an image in which layers lie below one another.

    Attributes:
        layers: The layers of that image.
        x, y: (n, columns) column and row in it of the nearer of the two layers around each place.
        share: (n, columns, 4) part of the farther one, for each channel: numpy is slow along a
            short axis.
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
        np.clip(at, 0, np.float32(length - 1))
        for at, length in ((x, columns), (y, rows), (z, layers))
    )
    near = np.minimum(np.floor(z), np.float32(layers - 2))
    first, last = int(near.min()), int(near.max()) + 2
    width = x.shape[-1]
    share = as_plane(z - near).reshape(-1, width)
    return _Places(
        slice(first, last),
        as_plane(x).reshape(-1, width),
        as_plane(y + (near - np.float32(first)) * np.float32(rows)).reshape(-1, width),
        as_plane(cv2.merge((share, share, share, share))),
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
    # Rows of cubes with their channels, as numpy is slow along an axis of four.
    flat = rows, columns * 4
    blown = np.tile(wind, (1, columns))

    def before(part: slice, offset: Field) -> _Places:
        """Return the places from which an offset (n, rows, columns, 4), cubes, leads to a slab."""
        z = np.arange(part.start, part.stop, dtype=np.float32)[:, None, None]
        return places(grid, *(at - offset[..., k] for k, at in enumerate((x, y, z))))

    def there(part: slice) -> tuple[Field, _Places]:
        velocity = carried.velocity[part]
        half = velocity.reshape(-1, *flat) + blown
        half *= cubes * np.float32(0.5)
        middle = look_up(carried.velocity, before(part, half.reshape(velocity.shape)))
        middle = middle.reshape(half.shape)
        middle += blown
        middle *= cubes
        offset = middle.reshape(velocity.shape)
        origin = before(part, offset)
        for field, result in zip(carried, moved, strict=True):
            result[part] = look_up(field, origin).reshape(offset.shape)
        return offset, origin

    traced = dict(
        zip((part.start for part in grid.slabs()), grid.each_slab(workers, there), strict=True)
    )

    def back(part: slice) -> None:
        offset, origin = traced.pop(part.start)
        shape = offset.shape
        # The way on from here has its own velocity half way: u(x + ½) = 2 u(x) − u(x − ½).
        behind = carried.velocity[part].reshape(-1, *flat) + blown
        behind *= -2 * cubes
        behind += offset.reshape(-1, *flat)
        returned = before(part, behind.reshape(shape))
        corner_y = np.floor(origin.y)
        for field, once, amount, result in zip(carried, moved, sharpness, results, strict=True):
            value = look_up(once, returned).reshape(shape)
            np.subtract(field[part], value, out=value)
            by_channel = value.reshape(-1, *flat)
            by_channel *= np.tile(amount, columns)
            value += once[part]
            least, greatest = _corners(field[origin.layers], origin, corner_y)
            np.maximum(value, least.reshape(shape), out=value)
            np.minimum(value, greatest.reshape(shape), out=result[part])

    grid.each_slab(workers, back)
    return results


def _corners(layers: Field, at: _Places, corner_y: Field) -> tuple[Field, Field]:
    """Return the least and the greatest of the eight cubes around places, (n, columns, 4) each."""
    corner_x = np.floor(at.x)
    found = []
    for pick in (np.minimum, np.maximum):
        # Of a cube with the one behind it, those below, and those to the right.
        two = pick(layers[:-1], layers[1:])
        four, eight = np.empty_like(two), np.empty_like(two)
        pick(two[:, :-1], two[:, 1:], out=four[:, :-1])
        four[:, -1] = two[:, -1]
        pick(four[:, :, :-1], four[:, :, 1:], out=eight[:, :, :-1])
        eight[:, :, -1] = four[:, :, -1]
        image = eight.reshape(-1, *layers.shape[2:])
        found.append(sample_at(image, corner_x, corner_y, _NEAREST))
    return found[0], found[1]
