"""The sheets as they never change: nodes, springs, masses, what is pinned.

Lengths are frame heights, x to the right, y away from the front view, z up; times are seconds.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float64]
"""(sheets, rows, columns, 3): one vector a node. Row 0 is the base, column 0 the left edge."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a sheet hangs and how large it is.

    Attributes:
        position: (x, y, z) of the middle of its base, heights.
        width, height: Heights.
        angle: Direction of its width seen from above, degrees; 0 to the right, counter-clockwise.
    """

    position: tuple[float, float, float]
    width: float
    height: float
    angle: float


@dataclass(frozen=True, slots=True)
class Elastic:
    """Springs and masses of silk.

    Attributes:
        mass: Of a node.
        structural, shear, bending: Stiffness of a spring to the next node along a row or column,
            across a cell, and to the next but one; force over length.
        damping: Of every spring, force over speed along it.
    """

    mass: float
    structural: float
    shear: float
    bending: float
    damping: float


@dataclass(frozen=True, slots=True)
class Springs:
    """All springs that join a node to the one ``down`` rows and ``right`` columns on.

    Attributes:
        down, right: Steps of rows and columns; ``right`` may be negative.
        stiffness: Force over length.
        rest: (sheets, rows', columns') lengths without force.
    """

    down: int
    right: int
    stiffness: float
    rest: NDArray[np.float64]

    def ends(self, nodes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Views of an array (sheets, rows, columns, ...) at the two ends of every spring."""
        down, right = self.down, self.right
        rows, columns = nodes.shape[1:3]
        if right >= 0:
            return nodes[:, : rows - down, : columns - right], nodes[:, down:, right:]
        return nodes[:, : rows - down, -right:], nodes[:, down:, : columns + right]


@dataclass(frozen=True, slots=True)
class Model:
    """Sheets of equal mesh.

    Attributes:
        rest: Positions of the nodes before anything moves.
        springs: Families of springs.
        damping: Of every spring, force over speed.
        mass: Of a node.
        free: (1, rows, 1, 1): 1 where nodes move, 0 where they are pinned.
    """

    rest: Vectors
    springs: tuple[Springs, ...]
    damping: float
    mass: float
    free: NDArray[np.float64]

    @property
    def sheets(self) -> int:
        """How many sheets."""
        return len(self.rest)


def build_model(
    placements: Sequence[Placement],
    rows: int,
    columns: int,
    elastic: Elastic,
    pinned_rows: int = 1,
) -> Model:
    """Hang up flat, upright sheets.

    Raises:
        ValueError: A sheet would have fewer than 2 rows or columns, or a mass is not positive.
    """
    if rows < 2 or columns < 2:
        raise ValueError(f"a sheet needs at least 2 rows and 2 columns; got {rows} and {columns}")
    if not elastic.mass > 0:
        raise ValueError(f"a node's mass must be more than 0; got {elastic.mass:g}")
    rest = np.stack([_flat(placement, rows, columns) for placement in placements])
    free = (np.arange(rows) >= pinned_rows).astype(np.float64)[None, :, None, None]
    return Model(rest, tuple(_springs(rest, elastic)), elastic.damping, elastic.mass, free)


def _flat(placement: Placement, rows: int, columns: int) -> NDArray[np.float64]:
    angle = math.radians(placement.angle)
    across = (np.arange(columns) / (columns - 1) - 0.5) * placement.width
    up = np.arange(rows) / (rows - 1) * placement.height
    nodes = np.empty((rows, columns, 3))
    nodes[..., 0] = placement.position[0] + across * math.cos(angle)
    nodes[..., 1] = placement.position[1] + across * math.sin(angle)
    nodes[..., 2] = placement.position[2] + up[:, None]
    return nodes


_FAMILIES = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 0), (0, 2))
"""Structural, shear and bending springs (Figure 2): steps of rows and columns."""


def _springs(rest: Vectors, elastic: Elastic) -> list[Springs]:
    stiffness = (elastic.structural,) * 2 + (elastic.shear,) * 2 + (elastic.bending,) * 2
    families = []
    for (down, right), k in zip(_FAMILIES, stiffness, strict=True):
        if k > 0 and down < rest.shape[1] and right < rest.shape[2]:
            one, other = Springs(down, right, k, np.empty(0)).ends(rest)
            families.append(Springs(down, right, k, length(other - one)))
    return families


def length(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths (...) of vectors (..., 3)."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.sqrt(x * x + y * y + z * z)
