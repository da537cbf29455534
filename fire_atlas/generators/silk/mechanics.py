"""Position Verlet for sheets of springs (Balci & Foroosh, section 3).

``step`` is pure: a model that never changes and a state give the next state.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.generators.silk.mesh import Model, Vectors, length

External = Callable[[Vectors, Vectors], Vectors]
"""``external(x, v)``: acceleration of every node by what is not a spring, heights/s²."""

_SAFETY = 0.7
"""Part of the longest stable step that is taken: springs that turn and stretch are not linear."""


@dataclass(frozen=True, slots=True)
class State:
    """The nodes at a time t and one step before (eq. 1, 14).

    Attributes:
        x: Positions at t, heights.
        before: Positions at t − δt.
    """

    x: Vectors
    before: Vectors

    @classmethod
    def moving(cls, x: Vectors, v: Vectors, a: Vectors, dt: float) -> "State":
        """State at positions ``x`` with velocity ``v`` and acceleration ``a``: eq. 13."""
        return cls(x, x - v * dt + 0.5 * dt * dt * a)

    @classmethod
    def resting(cls, x: Vectors) -> "State":
        """State at positions ``x`` where nothing moves."""
        return cls(x, x)

    def velocity(self, dt: float) -> Vectors:
        """Velocities, heights/s, by eq. 15."""
        return (self.x - self.before) / dt


def step(model: Model, state: State, external: External, dt: float) -> State:
    """Carry ``state`` on by ``dt``: x(t+δt) = 2x(t) − x(t−δt) + δt² a (eq. 14).

    Pinned nodes feel no force: they rest, or go on as they are moved.
    """
    v = state.velocity(dt)
    a = (spring_force(model, state.x, v) / model.mass + external(state.x, v)) * model.free
    return State(2 * state.x - state.before + a * (dt * dt), state.x)


def spring_force(model: Model, x: Vectors, v: Vectors) -> Vectors:
    """Force on every node: (k (|d| − rest) + c ḋ) along each spring d."""
    force = np.zeros_like(x)
    for springs in model.springs:
        one, other = springs.ends(x)
        along = other - one
        long = np.maximum(length(along), 1e-9)
        pull = springs.stiffness * (1 - springs.rest / long)
        if model.damping > 0:
            slow, fast = springs.ends(v)
            rate = np.einsum("srcd,srcd->src", fast - slow, along)
            pull = pull + model.damping * rate / (long * long)
        along *= pull[..., None]
        at_one, at_other = springs.ends(force)
        at_one += along
        at_other -= along
    return force


def energy(model: Model, state: State, dt: float) -> float:
    """Kinetic and spring energy half way between the two positions of a state."""
    v = state.velocity(dt)
    total = 0.5 * model.mass * float((v * v).sum())
    for springs in model.springs:
        stretch = []
        for x in (state.before, state.x):
            one, other = springs.ends(x)
            stretch.append(length(other - one) - springs.rest)
        # As the leapfrog keeps it: the product of both ends, not the mean of their squares.
        total += 0.5 * springs.stiffness * float((stretch[0] * stretch[1]).sum())
    return total


def longest_step(model: Model, drag: float) -> float:
    """Longest stable δt, s, with a margin.

    A node's springs bound the highest frequency of the whole mesh (Gershgorin): ω² ≤ 2 Σk / m.
    Eq. 11 looks at one spring alone and is too long. Damping at the rate γ, which eq. 15 takes from
    the step before, shortens it further: ω²δt² + 2γδt < 4.

    Args:
        model: The sheets.
        drag: Rate at which air stops a node, 1/s.
    """
    stiffness, springs = np.zeros(model.rest.shape[:3]), np.zeros(model.rest.shape[:3])
    for family in model.springs:
        for end in family.ends(stiffness):
            end += family.stiffness
        for end in family.ends(springs):
            end += 1
    square = 2 * float(stiffness.max()) / model.mass
    rate = 2 * model.damping * float(springs.max()) / model.mass + drag
    if square == 0:
        return _SAFETY * 2 / max(rate, 1e-9)
    return _SAFETY * (math.sqrt(rate * rate + 4 * square) - rate) / square


def normals(x: Vectors) -> NDArray[np.float64]:
    """Unit vectors (sheets, rows, columns, 3) orthogonal to the sheets."""
    across, up = np.empty_like(x), np.empty_like(x)
    across[:, :, 1:-1] = x[:, :, 2:] - x[:, :, :-2]
    across[:, :, 0], across[:, :, -1] = x[:, :, 1] - x[:, :, 0], x[:, :, -1] - x[:, :, -2]
    up[:, 1:-1] = x[:, 2:] - x[:, :-2]
    up[:, 0], up[:, -1] = x[:, 1] - x[:, 0], x[:, -1] - x[:, -2]
    normal = np.cross(across, up)
    return np.asarray(normal / np.maximum(length(normal), 1e-12)[..., None])
