"""Marks that show how a fire was analysed: arrows and dots over its frames (Kim & Lee).

Five layers, after the paper's Figures 6, 7 and 10; ``LAYERS`` describes them. ``field_data.py``
packs them into the preview page, where ``templates/preview/field_marks.js`` draws them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane
from fire_atlas.effect.field.forcing import cell_means

FieldLayer = Literal["features", "candidates", "force", "field", "blur"]


@dataclass(frozen=True, slots=True)
class LayerText:
    """What a layer shows, in words.

    Attributes:
        word: For a choice of layers.
        title: With the symbol and the equation of the paper.
        unit: Of the length of arrows or the weight of dots.
    """

    word: str
    title: str
    unit: str = ""


LAYERS: Mapping[FieldLayer, LayerText] = {
    "features": LayerText("Features", "Fv*, refined feature vectors (eq. 3)"),
    "candidates": LayerText(
        "Candidates", "candidates for flakes, by the weight with which they are chosen"
    ),
    "force": LayerText("Force", "U_buoyancy, what drives the field (eq. 11, 12)", "px/s/s"),
    "field": LayerText("Field", "Bv, the buoyancy field (eq. 12)", "px/s"),
    "blur": LayerText("Blur", "Bv kappa, while the shutter is open (eq. 17)", "px"),
}

RAMP = ((70, 110, 255), (50, 225, 215), (255, 250, 130))
"""Colours of short, medium and long arrows, sRGB: none of them is a colour of fire."""

SHORTEST = 0.04
"""Arrows shorter than this part of the longest are not drawn."""

LONGEST = 1.15
"""Length at which the longest arrow is drawn, in distances between arrows."""

_ARROWS, _DOTS = 28, 160
"""Number of arrows, and of places for dots, along the longer side of a frame."""

_QUANTILE = 0.99
"""The clip's longest arrow is this quantile of their lengths: few are drawn shorter than they
are."""

Marks = NDArray[np.float32]
"""Arrows: (n, 4), where each begins, and its vector in units of its layer, y down. Candidates:
(n, 3), place and weight."""


@dataclass(frozen=True, slots=True)
class MarkGrid:
    """How densely marks lie on frames of one size.

    Attributes:
        spacing: Distance between arrows, px, a multiple of the field's cell.
        block: Candidates within squares of this side, px, share a dot.
    """

    spacing: int
    block: int

    @classmethod
    def of(cls, width: int, height: int, cell: int) -> "MarkGrid":
        """Return the grid for frames of ``width`` by ``height`` px on a field of ``cell`` px."""
        side = max(width, height)
        return cls(cell * max(1, math.ceil(side / _ARROWS / cell)), max(1, round(side / _DOTS)))

    def strongest(self, x: Plane, y: Plane, corner: tuple[int, int]) -> Marks:
        """Return the longest vector of each square of the grid in which there is any.

        Not their mean: feature vectors on both sides of an edge cancel.

        Args:
            x, y: (H, W), a vector for each pixel.
            corner: (left, top) of these pixels in the frame.
        """
        row, column = np.nonzero((x != 0) | (y != 0))
        length = np.hypot(x[row, column], y[row, column])
        order = np.argsort(-length, kind="stable")
        row, column = row[order], column[order]
        square = np.column_stack([row + corner[1], column + corner[0]]) // self.spacing
        _, first = np.unique(square, axis=0, return_index=True)
        row, column = row[first], column[first]
        places = column + corner[0] + 0.5, row + corner[1] + 0.5
        return np.column_stack([*places, x[row, column], y[row, column]]).astype(np.float32)

    def means(self, u: Plane, v: Plane, cell: int) -> Marks:
        """Return the mean vector of each square, of a grid (rows, columns) of ``cell`` px."""
        x, y = (cell_means(plane, self.spacing // cell) for plane in (u, v))
        row, column = np.indices(x.shape)
        places = ((index.ravel() + 0.5) * self.spacing for index in (column, row))
        return np.column_stack([*places, x.ravel(), y.ravel()]).astype(np.float32)

    def dots(self, x: NDArray[np.intp], y: NDArray[np.intp], weight: NDArray[np.float64]) -> Marks:
        """Return candidate pixels (n,) that share a square as one dot, in the middle of them."""
        square = np.column_stack([y, x]) // self.block
        _, which = np.unique(square, axis=0, return_inverse=True)
        total = np.bincount(which, weight)
        places = (np.bincount(which, weight * (place + 0.5)) / total for place in (x, y))
        return np.column_stack([*places, total]).astype(np.float32)


@dataclass(frozen=True, slots=True)
class FieldMarks:
    """Marks of all frames of an animation.

    Attributes:
        grid: How densely they lie.
        frames: Marks of each frame by layer; a recipe without motion blur has none for it.
        longest: Length of the clip's longest arrows, or weight of its heaviest dots, by layer.
    """

    grid: MarkGrid
    frames: Sequence[Mapping[FieldLayer, Marks]]
    longest: Mapping[FieldLayer, float]

    @classmethod
    def of(cls, grid: MarkGrid, frames: Sequence[Mapping[FieldLayer, Marks]]) -> "FieldMarks":
        """Find out how long the longest are."""
        longest: dict[FieldLayer, float] = {}
        for layer in frames[0]:
            sizes = np.concatenate([sizes_of(frame[layer]) for frame in frames])
            sizes = sizes[sizes > 0]
            longest[layer] = float(np.quantile(sizes, _QUANTILE)) if sizes.size else 0.0
        return cls(grid, frames, longest)


def size_text(longest: float, layer: FieldLayer) -> str:
    """Return the size of the largest marks of a layer, with its unit."""
    return f"{float(f'{longest:.3g}'):,g} {LAYERS[layer].unit}".rstrip()


def sizes_of(marks: Marks) -> NDArray[np.float32]:
    """Return the lengths of arrows or the weights of dots, (n,)."""
    return marks[:, 2] if marks.shape[1] == 3 else np.hypot(marks[:, 2], marks[:, 3])
