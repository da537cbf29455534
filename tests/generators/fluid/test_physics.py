"""The solver of gas against what is known of it: advection, lift, divergence, symmetry, rest."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.advection import Carried, mac_cormack
from fire_atlas.generators.fluid.forces import Forces, push
from fire_atlas.generators.fluid.grid import Field, FluidGrid
from fire_atlas.generators.fluid.noise import Stirring
from fire_atlas.generators.fluid.projection import Projection
from fire_atlas.generators.fluid.scene import Scene, build_scene
from fire_atlas.generators.fluid.simulation import Simulation
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind

HALF = np.full(4, 0.5, np.float32)


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    with Workers(2) as pool:
        yield pool


def box(shape: tuple[int, int, int], *, has_ground: bool = False) -> FluidGrid:
    """Return a box a height high around its middle."""
    layers, rows, columns = shape
    return FluidGrid(shape, 1 / rows, (columns / 2, rows / 2, layers / 2), has_ground)


def scene(**keys: object) -> Scene:
    """Return a small campfire with ``keys`` of its source."""
    source = FluidSource.model_validate(
        {"kind": "fluid", "resolution": 24, "width": 64, "height": 80, **keys}
    )
    settings = GenerationSettings(3, Wind(), 24, 24.0, True, Views())
    return build_scene(source, settings)


def turned_once(cells: int, workers: Workers) -> tuple[float, float]:
    """Return the mean error and the change of the total of a passive ball, carried once around in a
    flow that turns as a whole in the middle and rests at the border."""
    grid = box((8, cells, cells))
    x, y = grid.right, -grid.up
    radius = np.sqrt(x * x + y * y)
    slow = np.clip((0.49 - radius) / 0.08, 0, 1)
    spin = 2 * np.pi * slow * slow * (3 - 2 * slow)
    velocity, scalars = grid.zeros(4), grid.zeros(4)
    velocity[..., 0], velocity[..., 1] = -spin * y, spin * x
    ball = np.exp(-((x - 0.17) ** 2 + y**2) / (2 * 0.08**2))
    scalars[..., 0] = ball
    still, steps = np.zeros((cells, 4), np.float32), 2 * cells
    carried = Carried(velocity, scalars)
    for _ in range(steps):
        moved = mac_cormack(grid, carried, still, 1 / steps, Carried(HALF, HALF), workers)
        carried = Carried(velocity, moved.scalars)
    after = carried.scalars[..., 0]
    error = float(np.abs(after - ball).mean() / ball.mean())
    return error, abs(float(after.sum() / (ball.sum() * 8)) - 1)


def test_a_field_that_turned_once_is_back_with_second_order(workers: Workers) -> None:
    errors = {cells: turned_once(cells, workers) for cells in (40, 80)}
    order = np.log2(errors[40][0] / errors[80][0])
    print(f"errors {errors}, order {order:.2f}")
    assert order > 1.7
    assert errors[80][1] < 0.02


def test_a_light_ball_starts_with_two_thirds_of_its_lift(workers: Workers) -> None:
    """The air that it pushes aside adds half its own mass (Lamb, Hydrodynamics, § 92)."""
    grid = box((64, 64, 64))
    away = np.sqrt(grid.right**2 + grid.up**2 + grid.away**2)
    ball = np.clip((0.15 - away) / (2 * grid.cell) + 0.5, 0, 1).astype(np.float32)
    velocity = grid.zeros(4)
    lift, dt = 4.0, 1e-3
    stirring = Stirring.of(grid, 1.0, generator(0, RandomStream.STIRRING))
    push(grid, velocity, ball, Forces(lift, 0, 0, 0), stirring, 0.0, dt, workers)
    Projection.of(grid).project(velocity, grid.zeros(), workers)
    inside = away < 0.12
    start = -float(velocity[..., 1][inside].mean()) / dt
    assert start == pytest.approx(lift * 2 / 3, rel=0.05)


@pytest.mark.parametrize("has_ground", [False, True])
def test_no_divergence_is_left(has_ground: bool, workers: Workers) -> None:
    grid = box((24, 40, 32), has_ground=has_ground)
    chance = np.random.default_rng(1)
    velocity = chance.normal(size=(*grid.shape, 4)).astype(np.float32)
    projection = Projection.of(grid)
    before = projection.divergence(velocity, workers)
    projection.project(velocity, grid.zeros(), workers)
    after = projection.divergence(velocity, workers)
    print(f"left {np.abs(after).max() / np.abs(before).max():.2e}")
    assert np.abs(after).max() < 1e-4 * np.abs(before).max()


def test_what_burns_grows_by_what_is_asked(workers: Workers) -> None:
    grid = box((32, 32, 32))
    source = np.exp(-(grid.right**2 + grid.up**2 + grid.away**2) / 0.02).astype(np.float32)
    velocity = grid.zeros(4)
    projection = Projection.of(grid)
    projection.project(velocity, source, workers)
    found = projection.divergence(velocity, workers)
    assert np.abs(found - source).max() < 1e-3


def test_still_air_stays_still(workers: Workers) -> None:
    silent = replace(scene(), burners=())
    simulation = Simulation(silent, workers)
    for _ in range(3):
        simulation.frame()
    assert not simulation.gas.velocity.any()
    assert not simulation.gas.scalars.any()


def test_a_symmetric_burner_stays_symmetric(workers: Workers) -> None:
    plain = scene(fire="torch", turbulence=0)
    burner = replace(
        plain.burners[0], ragged=0.0, pulse=0.0, wander=0.0, spread=0.0, at=(0.0, 0.0, 0.0)
    )
    grid = replace(plain.grid, origin=(plain.grid.shape[2] / 2, *plain.grid.origin[1:]))
    simulation = Simulation(replace(plain, burners=(burner,), grid=grid), workers)
    steps = 0
    while steps < 24:
        steps += simulation.frame()
    gas = simulation.gas.scalars
    assert gas[..., 1].max() > 0.5
    assert float(np.abs(gas - gas[:, :, ::-1]).max()) <= 1e-3
    assert float(np.abs(gas - gas[::-1]).max()) <= 1e-3


def burnt(workers: Workers, change: Callable[[Scene], Scene] = lambda scene: scene) -> Field:
    """Return the gas of a campfire after four frames."""
    simulation = Simulation(change(scene()), workers)
    for _ in range(4):
        simulation.frame()
    return simulation.gas.scalars


def test_the_same_bytes_with_any_number_of_workers(workers: Workers) -> None:
    with Workers(1) as one, Workers(5) as five:
        expected = burnt(one).tobytes()
        assert burnt(workers).tobytes() == expected
        assert burnt(five).tobytes() == expected


@pytest.mark.skipif("*AVX2" not in cv2.getCPUFeaturesLine().split(), reason="needs a CPU with AVX2")
def test_the_same_bytes_without_the_newest_instructions() -> None:
    program = str(Path(__file__).with_name("same_bytes.py"))
    newest, without = (
        subprocess.run(
            [sys.executable, program, sets], capture_output=True, text=True, check=True
        ).stdout
        for sets in ("with-avx2", "without-avx2")
    )
    assert newest == without and len(newest.split()) == 4
