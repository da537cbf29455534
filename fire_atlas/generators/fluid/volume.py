"""The gas of a frame as it is kept: a byte for each channel of a cube, compressed."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from zlib_ng import zlib_ng

from fire_atlas.generators.fluid.grid import Field

_CHANNELS = 3

_MOST = np.array([1.0, 3.0, 4.0, 1.0], np.float32)
"""Fuel, temperature, smoke and an empty channel at 255; a byte is the root of a value, so that thin
gas keeps its steps small."""


@dataclass(frozen=True, slots=True)
class Volume:
    """Fuel, temperature and smoke of a frame.

    Attributes:
        shape: Layers, rows and columns.
        box: Begin and end of the part that is not empty, along each axis.
        data: Its bytes, compressed.
    """

    shape: tuple[int, int, int]
    box: tuple[tuple[int, int], ...]
    data: bytes

    @classmethod
    def of(cls, scalars: Field) -> Self:
        """Keep scalars (layers, rows, columns, 4), of which the last channel is empty."""
        # Rows of cubes with their channels, as numpy is slow along an axis of four.
        share = scalars.reshape(*scalars.shape[:2], -1) / np.tile(_MOST, scalars.shape[2])
        np.sqrt(np.clip(share, 0, 1, out=share), out=share)
        share *= np.float32(255)
        coded = np.rint(share, out=share).astype(np.uint8).reshape(scalars.shape)
        filled, box = coded.view(np.uint32)[..., 0] != 0, []
        for axis in range(3):
            others = tuple(k for k in range(3) if k != axis)
            places = np.flatnonzero(filled.any(axis=others))
            box.append((int(places[0]), int(places[-1]) + 1) if len(places) else (0, 0))
        part = coded[tuple(slice(*ends) for ends in box)][..., :_CHANNELS]
        layers, rows, columns = filled.shape
        return cls((layers, rows, columns), tuple(box), zlib_ng.compress(part.tobytes(), 1))

    def scalars(self) -> Field:
        """Return the scalars (layers, rows, columns, 4); the last channel is empty."""
        found = np.zeros((*self.shape, 4), np.float32)
        coded = np.frombuffer(zlib_ng.decompress(self.data), np.uint8)
        part = coded.reshape(*(end - begin for begin, end in self.box), _CHANNELS)
        value = part * np.float32(1 / 255)
        found[tuple(slice(*ends) for ends in self.box)][..., :_CHANNELS] = (
            value * value * _MOST[:_CHANNELS]
        )
        return found
