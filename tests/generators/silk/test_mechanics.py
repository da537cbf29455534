"""Springs and masses against what physics knows about them."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.generators.silk.mechanics import (
    Elasticity,
    SheetModel,
    SheetPlacement,
    SheetState,
    SpringFamily,
    StepLimit,
    Vectors,
    build_model,
    lengths,
    normals,
    spring_force,
    step,
)

K, M, LENGTH = 40.0, 0.25, 0.5


def longest_step(model: SheetModel, drag: float) -> float:
    return StepLimit.of(model, drag).longest_step


def nothing(x: Vectors, _: Vectors) -> Vectors:
    return np.zeros_like(x)


def energy(model: SheetModel, state: SheetState, dt: float) -> float:
    """Kinetic and spring energy halfway between the two positions of a state."""
    v = state.velocity(dt)
    total = 0.5 * float((model.mass * v * v).sum())
    for springs in model.springs:
        stretch = []
        for x in (state.previous, state.x):
            start, end = springs.ends(x)
            stretch.append(lengths(end - start) - springs.rest)
        # As the leapfrog keeps it: the product of both ends, not the mean of their squares.
        total += 0.5 * float((springs.stiffness * stretch[0] * stretch[1]).sum())
    return total


def moving(x: Vectors, v: Vectors, a: Vectors, dt: float) -> SheetState:
    """State at positions ``x`` with velocity ``v`` and acceleration ``a``: eq. 13."""
    return SheetState(x, x - v * dt + 0.5 * dt * dt * a)


def one_spring() -> SheetModel:
    """A node that hangs on a pinned one."""
    rest = np.zeros((1, 2, 1, 3))
    rest[0, 1, 0, 2] = LENGTH
    free = np.array([0.0, 1.0])[None, :, None, None]
    one = np.ones((1, 1, 1))
    spring = SpringFamily(1, 0, K * one, 0 * one, LENGTH * one)
    return SheetModel(rest, (spring,), np.full((1, 2, 1, 1), M), free)


def sheet(rows: int = 10, columns: int = 7, pinned: int = 1, damping: float = 0.0) -> SheetModel:
    elasticity = Elasticity(mass=0.11, structural=20.0, shear=7.0, bending=2.0, damping=damping)
    return build_model(
        [SheetPlacement((0.0, 0.0, 0.0), 0.4, 0.8, 30.0)], rows, columns, [elasticity], pinned
    )


def crumpled(model: SheetModel, seed: int = 1) -> Vectors:
    """The sheet, every free node moved a little."""
    chance = np.random.default_rng(seed)
    return model.rest + model.free * chance.normal(0, 0.006, model.rest.shape)


def swing(dt: float, duration: float) -> NDArray[np.float64]:
    """Height of the one node, drawn out by a hundredth and let go, at every step."""
    model = one_spring()
    x = model.rest.copy()
    x[0, 1, 0, 2] += 0.01
    a = spring_force(model, x, np.zeros_like(x)) / M
    state = moving(x, np.zeros_like(x), a * model.free, dt)
    heights = [x[0, 1, 0, 2]]
    for _ in range(round(duration / dt)):
        state = step(model, state, nothing, dt)
        heights.append(state.x[0, 1, 0, 2])
    return np.array(heights) - LENGTH


def test_a_spring_swings_at_the_root_of_stiffness_over_mass() -> None:
    dt = 0.002
    found = swing(dt, 5.0)
    down = np.flatnonzero((found[:-1] > 0) & (found[1:] <= 0))
    crossings = down + found[down] / (found[down] - found[down + 1])
    period = float(np.mean(np.diff(crossings))) * dt
    assert period == pytest.approx(2 * math.pi * math.sqrt(M / K), rel=0.01)


def test_the_error_of_a_swing_falls_fourfold_when_steps_are_halved() -> None:
    omega = math.sqrt(K / M)

    def error(dt: float) -> float:
        found = swing(dt, 1.0)
        return float(np.abs(found - 0.01 * np.cos(omega * dt * np.arange(len(found)))).max())

    errors = [error(dt) for dt in (0.02, 0.01, 0.005)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.15)


def test_what_nothing_holds_falls_freely() -> None:
    model = sheet(pinned=0)
    g, dt, steps = -9.0, longest_step(model, 0.0), 200

    def weight(x: Vectors, _: Vectors) -> Vectors:
        a = np.zeros_like(x)
        a[..., 2] = g
        return a

    still = np.zeros_like(model.rest)
    state = moving(model.rest, still, weight(still, still), dt)
    for _ in range(steps):
        state = step(model, state, weight, dt)
    assert np.allclose(state.x - model.rest, [0, 0, 0.5 * g * (steps * dt) ** 2], atol=1e-9)


def test_an_unpinned_sheet_keeps_its_momentum() -> None:
    model = sheet(pinned=0, damping=0.5)
    dt = longest_step(model, 0.0)
    v = np.random.default_rng(4).normal(0, 0.3, model.rest.shape)
    x = crumpled(model)
    state = SheetState(x, x - v * dt)
    before = (model.mass * v).sum(axis=(0, 1, 2))
    for _ in range(500):
        state = step(model, state, nothing, dt)
    assert np.allclose((model.mass * state.velocity(dt)).sum(axis=(0, 1, 2)), before, atol=1e-9)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_energy_of_a_damped_sheet_that_nothing_drives_never_grows(seed: int) -> None:
    model = sheet(damping=1.0)
    dt = longest_step(model, 0.0) / 4
    state = SheetState.resting(crumpled(model, seed))
    energies = []
    for _ in range(1500):
        state = step(model, state, nothing, dt)
        energies.append(energy(model, state, dt))
    energies = energies[1:]
    assert energies[-1] < 0.2 * energies[0]
    assert np.diff(energies).max() <= 1e-6 * energies[0]


def test_an_undamped_sheet_keeps_its_energy() -> None:
    model = sheet()
    dt = longest_step(model, 0.0) / 4
    state = SheetState.resting(crumpled(model))
    energies = []
    for _ in range(2000):
        state = step(model, state, nothing, dt)
        energies.append(energy(model, state, dt))
    assert np.ptp(energies[10:]) < 0.02 * np.mean(energies)


def highest_frequency(model: SheetModel) -> float:
    """ω_max, rad/s, of the sheet near rest, from the eigenvalues of its stiffness."""
    size = model.rest.size
    matrix, nudge = np.empty((size, size)), 1e-6
    still = np.zeros_like(model.rest)
    for i in range(size):
        moved = np.zeros_like(model.rest)
        moved.flat[i] = nudge
        ahead = spring_force(model, model.rest + moved, still)
        behind = spring_force(model, model.rest - moved, still)
        matrix[:, i] = (behind - ahead).ravel() / (2 * nudge)
    masses = np.broadcast_to(model.mass, model.rest.shape).ravel()
    scaled = matrix / np.sqrt(np.outer(masses, masses))
    return math.sqrt(float(np.linalg.eigvalsh((scaled + scaled.T) / 2).max()))


def test_the_step_stays_under_what_the_whole_mesh_allows() -> None:
    """Eq. 11, which looks at one spring, does not."""
    model = sheet(rows=9, columns=6)
    limit = 2 / highest_frequency(model)
    assert 0.3 * limit < longest_step(model, 0.0) < limit
    stiffest = max(float(springs.stiffness.max()) for springs in model.springs)
    eq_11 = math.pi * math.sqrt(float(model.mass.max()) / stiffest)
    assert eq_11 > limit


@pytest.mark.parametrize(("damping", "drag"), [(0.0, 0.0), (1.0, 0.0), (1.0, 8.0), (25.0, 40.0)])
def test_steps_of_the_longest_kind_stay_bounded(damping: float, drag: float) -> None:
    model = sheet(damping=damping)
    dt = longest_step(model, drag)
    state = SheetState.resting(crumpled(model))

    def air(_: Vectors, v: Vectors) -> Vectors:
        return -drag * v

    for _ in range(3000):
        state = step(model, state, air, dt)
    assert np.abs(state.x - model.rest).max() < 0.2


def test_normals_are_orthogonal_to_a_turned_sheet() -> None:
    found = normals(sheet().rest)
    turn = math.radians(30)
    assert np.allclose(np.abs(found @ [math.sin(turn), -math.cos(turn), 0]), 1)


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 5), (5, 1)])
def test_a_sheet_of_one_node_is_refused(rows: int, columns: int) -> None:
    with pytest.raises(ValueError, match="at least 2 rows and 2 columns"):
        sheet(rows, columns)


@pytest.mark.parametrize("mass", [0.0, -1.0, math.nan])
def test_a_mass_must_be_positive(mass: float) -> None:
    placement = SheetPlacement((0.0, 0.0, 0.0), 1.0, 1.0, 0.0)
    with pytest.raises(ValueError, match="mass must be more than 0"):
        build_model([placement], 3, 3, [Elasticity(mass, 1.0, 1.0, 1.0, 0.0)])
