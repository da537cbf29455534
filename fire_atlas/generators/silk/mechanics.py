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
        up: (x, y, z) unit vector from its base to its top; its width turns with it.
    """

    position: tuple[float, float, float]
    width: float
    height: float
    angle: float
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Elasticity:
    """Mass, stiffness and damping of a sheet, whatever the number of its nodes.

    Attributes:
        mass: Mass of the sheet.
        structural, shear, bending: Stiffness of the springs to the next node along a row or column,
            to the next diagonally, and to the next but one along a row or column, in a mesh of 24
            rows and 16 columns; force/length.
        damping: Rate at which a spring is damped, 1/s: its damping, force per speed along it, is
            this times the mass of an inner node.
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
        stiffness: (sheets, rows', columns') force per length.
        damping: (sheets, rows', columns') force per speed along the spring.
        rest: (sheets, rows', columns') rest lengths.
    """

    down: int
    right: int
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
    rest: NDArray[np.float64]

    def ends(self, nodes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return views of an array (sheets, rows, columns, ...) at both ends of every spring."""
        return _ends(nodes, self.down, self.right)


@dataclass(frozen=True, slots=True)
class SheetModel:
    """Constant properties of the sheets, which all have the same mesh.

    Attributes:
        rest: Positions of the nodes at rest, heights.
        springs: All springs, by family.
        mass: (sheets, rows, columns, 1) mass of a node.
        free: (1, rows, 1, 1) 1 where nodes move, 0 where they are pinned.
    """

    rest: Vectors
    springs: tuple[SpringFamily, ...]
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
    """Build the mesh of flat sheets, each with its elasticity, whose lowest
    ``pinned_rows`` are pinned.

    A finer mesh is the same sheet: a node has the mass of the part of the sheet that is nearest to
    it, one at an edge half of an inner one's; springs along an edge are half as stiff, and all are
    as stiff as makes the sheet resist as much to being stretched and sheared.

    Raises:
        ValueError: Fewer than 2 rows or columns, or a mass that is not positive.
    """
    if rows < 2 or columns < 2:
        raise ValueError(f"a sheet needs at least 2 rows and 2 columns; got {rows} and {columns}")
    masses = np.array([elasticity.mass for elasticity in elasticities])[:, None, None]
    if not (masses > 0).all():
        raise ValueError(f"a sheet's mass must be more than 0; got {masses.min():g}")
    rest = np.stack([_flat_sheet(placement, rows, columns) for placement in placements])
    free = (np.arange(rows) >= pinned_rows).astype(np.float64)[None, :, None, None]
    inner = masses / ((rows - 1) * (columns - 1))
    area = np.outer(_halved_at_ends(rows), _halved_at_ends(columns))
    springs = tuple(_springs(rest, elasticities, inner))
    return SheetModel(rest, springs, (inner * area)[..., None], free)


def _flat_sheet(placement: SheetPlacement, rows: int, columns: int) -> NDArray[np.float64]:
    angle = math.radians(placement.angle)
    across = (np.arange(columns) / (columns - 1) - 0.5) * placement.width
    up = np.arange(rows) / (rows - 1) * placement.height
    right, away = across_of(placement.up)
    aside = math.cos(angle) * right + math.sin(angle) * away
    nodes = across[None, :, None] * aside + up[:, None, None] * np.array(placement.up)
    return np.asarray(nodes + placement.position)


def across_of(up: tuple[float, float, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where a turn that takes [0, 0, 1] to the unit vector ``up`` on the shortest way takes
    [1, 0, 0] and [0, 1, 0]."""
    x, y, z = up
    if z < -1 + 1e-9:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])
    share = 1 / (1 + z)
    right = np.array([1 - x * x * share, -x * y * share, -x])
    return right, np.array([-x * y * share, 1 - y * y * share, -y])


def _ends(
    nodes: NDArray[np.float64], down: int, right: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rows, columns = nodes.shape[1:3]
    if right >= 0:
        return nodes[:, : rows - down, : columns - right], nodes[:, down:, right:]
    return nodes[:, : rows - down, -right:], nodes[:, down:, : columns + right]


_FAMILIES = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 0), (0, 2))
"""(down, right) of the structural, shear and bending springs (Figure 2)."""


def _springs(
    rest: Vectors, elasticities: Sequence[Elasticity], inner: NDArray[np.float64]
) -> list[SpringFamily]:
    """Return all springs; ``inner`` (sheets, 1, 1) is the mass of an inner node."""
    rows, columns = rest.shape[1:3]
    damping = np.array([elasticity.damping for elasticity in elasticities])[:, None, None] * inner
    width, height = lengths(rest[:, 0, -1] - rest[:, 0, 0]), lengths(rest[:, -1, 0] - rest[:, 0, 0])
    stiffness = [
        _in_this_mesh(elasticity, float(aspect), rows, columns)
        for elasticity, aspect in zip(elasticities, width / height, strict=True)
    ]
    families = []
    for (down, right), k in zip(_FAMILIES, np.array(stiffness).T, strict=True):
        if k.any() and down < rows and right < columns:
            start, end = _ends(rest, down, right)
            share = np.ones(start.shape[1:3])
            if right == 0:
                share *= _halved_at_ends(columns)
            if down == 0:
                share *= _halved_at_ends(rows)[:, None]
            stiff = k[:, None, None] * share
            rest_lengths = lengths(end - start)
            families.append(SpringFamily(down, right, stiff, damping * share, rest_lengths))
    return families


_ROWS, _COLUMNS = 24, 16
"""Nodes of the mesh for which ``Elasticity`` states the stiffness of springs."""

_SHEAR_EXPONENT = 0.25
"""How far the stiffness of diagonals follows what keeps the resistance to being sheared. With 1,
long cells would be too stiff, as diagonals resist being stretched as well. With this, sheets of 4
to 48 rows and 4 to 24 columns lean alike within 5 % in wind of level 3."""


def _in_this_mesh(elasticity: Elasticity, aspect: float, rows: int, columns: int) -> list[float]:
    """Return the stiffness of the springs of each of ``_FAMILIES`` in a mesh of another fineness,
    on a sheet ``aspect`` times as wide as high.

    Of cells dx wide and dy high, springs k along dy resist being stretched by k dy / dx, and two
    diagonal ones d long resist being sheared by 2 k dx dy / d² = 2 k / (dx/dy + dy/dx).
    """
    cell, usual = aspect * (rows - 1) / (columns - 1), aspect * (_ROWS - 1) / (_COLUMNS - 1)
    up, across = cell / usual, usual / cell
    shear = elasticity.shear * ((cell + 1 / cell) / (usual + 1 / usual)) ** _SHEAR_EXPONENT
    return [
        elasticity.structural * up,
        elasticity.structural * across,
        shear,
        shear,
        elasticity.bending * up,
        elasticity.bending * across,
    ]


def _halved_at_ends(count: int) -> NDArray[np.float64]:
    """Return the parts (count,) of a line that are nearest to points evenly along it, relative to
    an inner point's."""
    share = np.ones(count)
    share[[0, -1]] = 0.5
    return share


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
    model: SheetModel,
    state: SheetState,
    external: ExternalAcceleration,
    dt: float,
    stiffening: float = 1.0,
) -> SheetState:
    """Return ``state`` after ``dt``: x(t+δt) = 2x(t) − x(t−δt) + δt² a (eq. 14).

    No force moves pinned nodes: they rest, or keep the velocity they were given. ``stiffening``
    multiplies the stiffness of all springs.
    """
    v = state.velocity(dt)
    force = spring_force(model, state.x, v, stiffening)
    a = (force / model.mass + external(state.x, v)) * model.free
    return SheetState(2 * state.x - state.previous + a * (dt * dt), state.x)


def spring_force(model: SheetModel, x: Vectors, v: Vectors, stiffening: float = 1.0) -> Vectors:
    """Return the force on every node: (k (|d| − rest) + c d|d|/dt) along each spring d, whose k
    are multiplied by ``stiffening``."""
    force = np.zeros_like(x)
    for springs in model.springs:
        start, end = springs.ends(x)
        along = end - start
        extent = np.maximum(lengths(along), 1e-9)
        tension = (stiffening * springs.stiffness) * (1 - springs.rest / extent)
        if springs.damping.any():
            v_start, v_end = springs.ends(v)
            rate = _dot(v_end - v_start, along)
            tension = tension + springs.damping * rate / (extent * extent)
        along *= tension[..., None]
        force_start, force_end = springs.ends(force)
        force_start += along
        force_end -= along
    return force


@dataclass(frozen=True, slots=True)
class StepLimit:
    """What limits the time step of a mesh: ω²δt² + 2γδt < 4.

    The springs at a node bound the frequency of the whole mesh (Gershgorin): ω² ≤ 2 Σk / m. Eq. 11
    considers a single spring, so its step is too long. Damping at the rate γ, with the velocity of
    the step before (eq. 15), shortens it further.

    Attributes:
        square: ω², 1/s².
        damping: γ by the damping of the springs, 1/s.
        drag: γ by the drag of the air, 1/s.
    """

    square: float
    damping: float
    drag: float

    @classmethod
    def of(cls, model: SheetModel, drag: float, stiffening: float = 1.0) -> Self:
        """Return the limit of a mesh whose springs are ``stiffening`` times as stiff, in air of a
        ``drag``, 1/s."""
        stiffness, damping = np.zeros(model.rest.shape[:3]), np.zeros(model.rest.shape[:3])
        for family in model.springs:
            for end in family.ends(stiffness):
                end += family.stiffness
            for end in family.ends(damping):
                end += family.damping
        mass = model.mass[..., 0]
        square = float((2 * stiffening * stiffness / mass).max())
        return cls(square, float((2 * damping / mass).max()), drag)

    @property
    def longest_step(self) -> float:
        """The longest stable time step, s, reduced by ``_SAFETY``."""
        rate = self.damping + self.drag
        if self.square == 0:
            return _SAFETY * 2 / max(rate, 1e-9)
        return _SAFETY * (math.sqrt(rate * rate + 4 * self.square) - rate) / self.square

    def most_stiffness(self, dt: float) -> float:
        """Return by what the stiffness may be multiplied at the most for steps of ``dt``, s; 0 or
        less if no stiffness is small enough."""
        dt = dt / _SAFETY
        return (4 - 2 * (self.damping + self.drag) * dt) / max(self.square * dt * dt, 1e-12)

    def most_damping(self, dt: float) -> float:
        """Return by what the damping of the springs may be multiplied at the most, likewise."""
        dt = dt / _SAFETY
        allowed = 4 - self.square * dt * dt - 2 * self.drag * dt
        return allowed / max(2 * self.damping * dt, 1e-12)

    def most_of_both(self, dt: float) -> tuple[float, float]:
        """Return by what stiffness and damping may be multiplied if each takes half of what drag
        leaves; 0 or less if drag leaves nothing."""
        dt = dt / _SAFETY
        half = 2 - self.drag * dt
        return half / max(self.square * dt * dt, 1e-12), half / max(2 * self.damping * dt, 1e-12)


def normals(x: Vectors) -> NDArray[np.float64]:
    """Return unit normals (sheets, rows, columns, 3) of the sheets at their nodes."""
    across, up = np.empty_like(x), np.empty_like(x)
    across[:, :, 1:-1] = x[:, :, 2:] - x[:, :, :-2]
    across[:, :, 0], across[:, :, -1] = x[:, :, 1] - x[:, :, 0], x[:, :, -1] - x[:, :, -2]
    up[:, 1:-1] = x[:, 2:] - x[:, :-2]
    up[:, 0], up[:, -1] = x[:, 1] - x[:, 0], x[:, -1] - x[:, -2]
    normal = np.cross(across, up)
    return np.asarray(normal / np.maximum(lengths(normal), 1e-12)[..., None])


def refined(x: Vectors, distance: float) -> Vectors:
    """Return nodes no farther than ``distance``, heights, from their neighbours, interpolated
    linearly between those of sheets: (sheets, more rows, more columns, 3)."""
    along = (lengths(np.diff(x, axis=axis)).sum(axis=axis).max() for axis in (1, 2))
    rows, columns = (math.ceil(length / distance) + 1 for length in along)
    return _interpolated(_interpolated(x, rows, 1), columns, 2)


def _interpolated(nodes: Vectors, count: int, axis: int) -> Vectors:
    """Return nodes with ``count`` along an axis, evenly between those given."""
    at = np.linspace(0, nodes.shape[axis] - 1, count)
    below = np.minimum(at.astype(np.intp), nodes.shape[axis] - 2)
    share = (at - below).reshape([-1 if k == axis else 1 for k in range(nodes.ndim)])
    first, second = np.take(nodes, below, axis), np.take(nodes, below + 1, axis)
    return np.asarray(first + (second - first) * share)
