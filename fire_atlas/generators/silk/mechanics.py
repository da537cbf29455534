"""Simulate sheets of silk as a mass-spring system by position Verlet (Balci & Foroosh, section 3).

``SheetModel`` is constant, ``SheetState`` changes with time, and ``step`` computes the next state.
Lengths are frame heights, x to the right, y away from the front view, z up; times are seconds.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float64]
"""(sheets, rows, columns, 3): one vector per node; row 0 is the base, column 0 the left edge."""


@dataclass(frozen=True, slots=True)
class SheetPlacement:
    """Position and size of a sheet at rest.

    Attributes:
        position: (x, y, z) of the middle of its base, heights.
        width, height: Size, heights.
        angle: Direction of its width seen from above, degrees counter-clockwise; 0: to the right.
    """

    position: tuple[float, float, float]
    width: float
    height: float
    angle: float


@dataclass(frozen=True, slots=True)
class Elasticity:
    """Mass, stiffness and damping of the mesh.

    Attributes:
        mass: Mass of a node.
        structural, shear, bending: Stiffness of the springs to the next node along a row or column,
            to the next diagonally, and to the next but one along a row or column; force/length.
        damping: Damping of every spring; force per speed along it.
    """

    mass: float
    structural: float
    shear: float
    bending: float
    damping: float


@dataclass(frozen=True, slots=True)
class SpringFamily:
    """All springs from a node to the one ``down`` rows and ``right`` columns further.

    Attributes:
        down, right: Steps of rows and columns; ``right`` may be negative.
        stiffness: (sheets, 1, 1) force per length.
        rest: (sheets, rows', columns') rest lengths.
    """

    down: int
    right: int
    stiffness: NDArray[np.float64]
    rest: NDArray[np.float64]

    def ends(self, nodes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return views of an array (sheets, rows, columns, ...) at both ends of every spring."""
        down, right = self.down, self.right
        rows, columns = nodes.shape[1:3]
        if right >= 0:
            return nodes[:, : rows - down, : columns - right], nodes[:, down:, right:]
        return nodes[:, : rows - down, -right:], nodes[:, down:, : columns + right]


@dataclass(frozen=True, slots=True)
class SheetModel:
    """Constant properties of the sheets, which all have the same mesh.

    Attributes:
        rest: Positions of the nodes at rest, heights.
        springs: All springs, by family.
        damping: (sheets, 1, 1) damping of every spring; force per speed.
        mass: (sheets, 1, 1, 1) mass of a node.
        free: (1, rows, 1, 1) 1 where nodes move, 0 where they are pinned.
    """

    rest: Vectors
    springs: tuple[SpringFamily, ...]
    damping: NDArray[np.float64]
    mass: NDArray[np.float64]
    free: NDArray[np.float64]

    @property
    def sheets(self) -> int:
        """Number of sheets."""
        return len(self.rest)


def build_model(
    placements: Sequence[SheetPlacement],
    rows: int,
    columns: int,
    elasticities: Sequence[Elasticity],
    pinned_rows: int = 1,
) -> SheetModel:
    """Build the mesh of flat, upright sheets, each with its elasticity, whose lowest
    ``pinned_rows`` are pinned.

    Raises:
        ValueError: Fewer than 2 rows or columns, or a mass that is not positive.
    """
    if rows < 2 or columns < 2:
        raise ValueError(f"a sheet needs at least 2 rows and 2 columns; got {rows} and {columns}")
    mass = np.array([each.mass for each in elasticities])
    if not (mass > 0).all():
        raise ValueError(f"a node's mass must be more than 0; got {mass.min():g}")
    rest = np.stack([_flat_sheet(each, rows, columns) for each in placements])
    free = (np.arange(rows) >= pinned_rows).astype(np.float64)[None, :, None, None]
    damping = np.array([each.damping for each in elasticities])
    springs = tuple(_springs(rest, elasticities))
    return SheetModel(rest, springs, damping[:, None, None], mass[:, None, None, None], free)


def _flat_sheet(placement: SheetPlacement, rows: int, columns: int) -> NDArray[np.float64]:
    angle = math.radians(placement.angle)
    across = (np.arange(columns) / (columns - 1) - 0.5) * placement.width
    up = np.arange(rows) / (rows - 1) * placement.height
    nodes = np.empty((rows, columns, 3))
    nodes[..., 0] = placement.position[0] + across * math.cos(angle)
    nodes[..., 1] = placement.position[1] + across * math.sin(angle)
    nodes[..., 2] = placement.position[2] + up[:, None]
    return nodes


_FAMILIES = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 0), (0, 2))
"""(down, right) of the structural, shear and bending springs (Figure 2)."""


def _springs(rest: Vectors, elasticities: Sequence[Elasticity]) -> list[SpringFamily]:
    stiffness = np.array([(e.structural, e.shear, e.bending) for e in elasticities]).T
    families = []
    for (down, right), k in zip(_FAMILIES, np.repeat(stiffness, 2, axis=0), strict=True):
        if k.any() and down < rest.shape[1] and right < rest.shape[2]:
            column = k[:, None, None]
            start, end = SpringFamily(down, right, column, np.empty(0)).ends(rest)
            families.append(SpringFamily(down, right, column, lengths(end - start)))
    return families


def lengths(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lengths (...) of vectors (..., 3)."""
    return np.sqrt(_dot(vectors, vectors))


def _dot(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the dot products (...) of vectors (..., 3), by axis: sums along a short axis of an
    array are slow in numpy."""
    x, y, z = (one[..., axis] * other[..., axis] for axis in range(3))
    return np.asarray(x + y + z)


ExternalAcceleration = Callable[[Vectors, Vectors], Vectors]
"""``external(x, v)``: acceleration of every node by all forces but the springs, heights/s²."""

_SAFETY = 0.7
"""Fraction of the longest stable step that is used, as springs that rotate are not linear."""


@dataclass(frozen=True, slots=True)
class SheetState:
    """Positions of the nodes at time t and one step before (eq. 1, 14).

    Attributes:
        x: Positions at t, heights.
        previous: Positions at t − δt.
    """

    x: Vectors
    previous: Vectors

    @classmethod
    def resting(cls, x: Vectors) -> Self:
        """Return the state at positions ``x`` in which nothing moves."""
        return cls(x, x)

    def velocity(self, dt: float) -> Vectors:
        """Return the velocities, heights/s (eq. 15)."""
        return (self.x - self.previous) / dt


def step(
    model: SheetModel, state: SheetState, external: ExternalAcceleration, dt: float
) -> SheetState:
    """Return ``state`` after ``dt``: x(t+δt) = 2x(t) − x(t−δt) + δt² a (eq. 14).

    No force moves pinned nodes: they rest, or keep the velocity they were given.
    """
    v = state.velocity(dt)
    a = (spring_force(model, state.x, v) / model.mass + external(state.x, v)) * model.free
    return SheetState(2 * state.x - state.previous + a * (dt * dt), state.x)


def spring_force(model: SheetModel, x: Vectors, v: Vectors) -> Vectors:
    """Return the force on every node: (k (|d| − rest) + c d|d|/dt) along each spring d."""
    force = np.zeros_like(x)
    for springs in model.springs:
        start, end = springs.ends(x)
        along = end - start
        extent = np.maximum(lengths(along), 1e-9)
        tension = springs.stiffness * (1 - springs.rest / extent)
        if model.damping.any():
            v_start, v_end = springs.ends(v)
            rate = _dot(v_end - v_start, along)
            tension = tension + model.damping * rate / (extent * extent)
        along *= tension[..., None]
        force_start, force_end = springs.ends(force)
        force_start += along
        force_end -= along
    return force


def longest_step(model: SheetModel, drag: float) -> float:
    """Return the longest stable time step, s, reduced by ``_SAFETY``.

    The springs at a node bound the frequency of the whole mesh (Gershgorin): ω² ≤ 2 Σk / m. Eq. 11
    considers a single spring, so its step is too long. Damping at the rate γ, with the velocity of
    the step before (eq. 15), shortens it further: ω²δt² + 2γδt < 4. γ includes ``drag``, 1/s.
    """
    stiffness, springs = np.zeros(model.rest.shape[:3]), np.zeros(model.rest.shape[:3])
    for family in model.springs:
        for end in family.ends(stiffness):
            end += family.stiffness
        for end in family.ends(springs):
            end += 1
    mass = model.mass[..., 0]
    square = float((2 * stiffness / mass).max())
    rate = float((2 * model.damping * springs / mass).max()) + drag
    if square == 0:
        return _SAFETY * 2 / max(rate, 1e-9)
    return _SAFETY * (math.sqrt(rate * rate + 4 * square) - rate) / square


def normals(x: Vectors) -> NDArray[np.float64]:
    """Return unit normals (sheets, rows, columns, 3) of the sheets at their nodes."""
    across, up = np.empty_like(x), np.empty_like(x)
    across[:, :, 1:-1] = x[:, :, 2:] - x[:, :, :-2]
    across[:, :, 0], across[:, :, -1] = x[:, :, 1] - x[:, :, 0], x[:, :, -1] - x[:, :, -2]
    up[:, 1:-1] = x[:, 2:] - x[:, :-2]
    up[:, 0], up[:, -1] = x[:, 1] - x[:, 0], x[:, -1] - x[:, -2]
    normal = np.cross(across, up)
    return np.asarray(normal / np.maximum(lengths(normal), 1e-12)[..., None])
