"""The gas of a frame as it is kept: a byte for each channel of a cube, compressed."""

import zlib
from dataclasses import dataclass
from typing import Self

import numpy as np

from fire_atlas.generators.fluid.grid import Field

_CHANNELS = 3

_MOST = np.array([1.0, 3.0, 4.0], np.float32)
"""Fuel, temperature and smoke at 255; a byte is the root of a value, so that thin gas keeps its
steps small."""


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
        """Keep scalars (layers, rows, columns, 3 or more)."""
        share = np.sqrt(np.clip(scalars[..., :_CHANNELS] / _MOST, 0, 1))
        coded = np.rint(share * np.float32(255)).astype(np.uint8)
        filled, box = coded.any(axis=3), []
        for axis in range(3):
            others = tuple(k for k in range(3) if k != axis)
            places = np.flatnonzero(filled.any(axis=others))
            box.append((int(places[0]), int(places[-1]) + 1) if len(places) else (0, 0))
        part = coded[tuple(slice(*ends) for ends in box)]
        layers, rows, columns = filled.shape
        return cls((layers, rows, columns), tuple(box), zlib.compress(part.tobytes(), 1))

    def scalars(self) -> Field:
        """Return the scalars (layers, rows, columns, 4); the last channel is empty."""
        found = np.zeros((*self.shape, 4), np.float32)
        coded = np.frombuffer(zlib.decompress(self.data), np.uint8)
        part = coded.reshape(*(end - begin for begin, end in self.box), _CHANNELS)
        value = part * np.float32(1 / 255)
        found[tuple(slice(*ends) for ends in self.box)][..., :_CHANNELS] = value * value * _MOST
        return found
