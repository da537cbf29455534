"""Find the grid of enlarged pixel art: how large its pixels are, and where they begin."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fire_atlas.core.clip import Clip, Window
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Pixels
from fire_atlas.vision.sampling import evenly_spread

_FRAMES = 3
"""Number of frames that are looked at."""

_ROWS = 16
"""Every so many rows of the first frame are looked at first."""

_MIN_EDGES = 6
"""Minimum number of columns, and of rows, at which colours change: fewer may be as far apart by
chance."""


@dataclass(frozen=True, slots=True)
class PixelGrid:
    """The pixels of art, each a square of pixels of its frames.

    Attributes:
        side: Width and height of a pixel of the art, px of the frame; 1 if it is not enlarged.
        x, y: Left and top edge of the first whole one, px, less than ``side``.
    """

    side: int = 1
    x: int = 0
    y: int = 0

    def cropped(self, window: Window) -> Self:
        """Return the grid of a window of the frame."""
        return replace(
            self, x=(self.x - window.left) % self.side, y=(self.y - window.top) % self.side
        )


NOT_ENLARGED = PixelGrid()
"""The grid of art whose pixels are those of its frames."""


def find_pixel_grid(clip: Clip) -> PixelGrid:
    """Return the grid of a clip that was enlarged by a whole number, each pixel to a square.

    All colours then change at columns, and at rows, that are multiples of its side apart.
    """
    some_rows = as_light(np.ascontiguousarray(clip.picture(0)[::_ROWS]))
    if math.gcd(*np.diff(_edges([some_rows])).tolist()) == 1:
        return NOT_ENLARGED  # which most clips are, and more edges do not change it
    frames = [clip.read(i) for i in evenly_spread(0, clip.count - 1, _FRAMES)]
    columns, rows = _edges(frames), _edges([frame.transpose(1, 0, 2) for frame in frames])
    if min(len(columns), len(rows)) < _MIN_EDGES:
        return NOT_ENLARGED
    side = math.gcd(*np.diff(columns).tolist(), *np.diff(rows).tolist())
    return PixelGrid(side, columns[0] % side, rows[0] % side)


def _edges(frames: list[Pixels]) -> list[int]:
    """Return the columns at which the colour of any pixel is another than to the left of it."""
    changes = [(frame[:, 1:] != frame[:, :-1]).any(axis=(0, 2)) for frame in frames]
    return (1 + np.flatnonzero(np.any(changes, axis=0))).tolist()
