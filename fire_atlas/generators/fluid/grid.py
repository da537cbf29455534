"""The box of cubes in which gas is simulated, cut into slabs that threads share.

Arrays have the axes layers (away from the viewer), rows (down) and columns (to the right). Vectors
are to the right, down and away, as in an image; velocities are in frame heights per second.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane
from fire_atlas.core.workers import Workers

Field = NDArray[np.float32]
"""(layers, rows, columns), or with four channels (layers, rows, columns, 4)."""

Result = TypeVar("Result")

SLAB = 8
"""Layers of a slab: its four channels stay in a CPU's cache, and its rows in the range of
``cv2.remap``. It decides last bits: places are counted from the first layer that a slab needs."""

_PART = 100_000
"""Cubes of a part of the box that a thread computes in one go: a channel of them stays in its
cache, and threads do not wait for each other more often than they compute."""


@dataclass(frozen=True)
class FluidGrid:
    """A box of cubes around the origin of the world.

    Attributes:
        shape: Number of layers, rows and columns.
        cell: Edge of a cube, heights.
        origin: Place of the world's origin in the box, (right, down, away) in cubes from its near
            top left corner.
        has_ground: Whether the bottom is solid; all other sides are open.
    """

    shape: tuple[int, int, int]
    cell: float
    origin: tuple[float, float, float]
    has_ground: bool

    def empty(self) -> Field:
        """Return a field of which each value is still to be set."""
        return np.empty(self.shape, np.float32)

    def zeros(self, channels: int | None = None) -> Field:
        """Return an empty field, with ``channels`` if any."""
        return np.zeros(self.shape if channels is None else (*self.shape, channels), np.float32)

    @cached_property
    def right(self) -> Field:
        """How far each column is to the right of the origin, heights: (1, 1, columns)."""
        return self._places(2)[None, None, :]

    @cached_property
    def up(self) -> Field:
        """How far each row is above the origin, heights: (1, rows, 1)."""
        return -self._places(1)[None, :, None]

    @cached_property
    def away(self) -> Field:
        """How far each layer is behind the origin, heights: (layers, 1, 1)."""
        return self._places(0)[:, None, None]

    def slabs(self) -> list[slice]:
        """Return the layers of each slab."""
        layers = self.shape[0]
        return [slice(begin, min(begin + SLAB, layers)) for begin in range(0, layers, SLAB)]

    def each_slab(self, workers: Workers, work: Callable[[slice], Result]) -> list[Result]:
        """Call ``work`` with the layers of each slab, and return what it returns, in order."""
        return list(workers.map(work, self.slabs()))

    def each_part(self, workers: Workers, work: Callable[[slice], Result]) -> list[Result]:
        """As ``each_slab``, for what is the same however the layers are divided: in parts that
        threads share evenly."""
        layers, rows, columns = self.shape
        count = round(layers * rows * columns / _PART)
        if count < 2:
            return [work(slice(0, layers))]
        count = min(workers.jobs * math.ceil(count / workers.jobs), layers)
        ends = [layers * k // count for k in range(count + 1)]
        return list(workers.map(work, map(slice, ends[:-1], ends[1:])))

    def _places(self, axis: int) -> Field:
        middle = np.arange(self.shape[axis]) + 0.5 - self.origin[2 - axis]
        return np.asarray(middle * self.cell, np.float32)


def slope(values: Field, layers: slice, axis: int) -> Field:
    """Return the central difference per cube of ``values`` along ``axis`` (0-2) in some layers.

    Beyond a border the value at it goes on.
    """
    if axis == 0:
        count = len(values)
        wanted = np.arange(layers.start, layers.stop)
        after = values[np.minimum(wanted + 1, count - 1)]
        return as_plane((after - values[np.maximum(wanted - 1, 0)]) * np.float32(0.5))
    part = values[layers]
    found = np.empty_like(part)
    inner, first, second, last, before = (
        tuple(index if k == axis else slice(None) for k in range(3))
        for index in (slice(1, -1), 0, 1, -1, -2)
    )
    ahead, behind = (
        tuple(index if k == axis else slice(None) for k in range(3))
        for index in (slice(2, None), slice(None, -2))
    )
    np.subtract(part[ahead], part[behind], out=found[inner])
    found[first], found[last] = part[second] - part[first], part[last] - part[before]
    found *= np.float32(0.5)
    return found
