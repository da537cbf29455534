"""Flight over fields whose answer is known."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.effect.flakes.ballistics import WEIGHT
from fire_atlas.effect.flakes.emission import SPARK, Spawns
from fire_atlas.effect.flakes.flight import FlightField, FlightSettings, fly
from fire_atlas.effect.flakes.particles import ParticleState

FRAMES = 24
FPS = 24.0


def _spawns(count: int, x: float = 100.0, y: float = 200.0, life: float = 10.0) -> Spawns:
    ones = np.ones(count)
    return Spawns(
        np.zeros(count, np.int64), np.zeros(count, np.int64), ones * x, ones * y, 0 * ones,
        0 * ones, 0 * ones, ones, life * ones, 2 * ones, 0 * ones,
        ones, 0 * ones, 0 * ones, 0 * ones, 0 * ones, 0 * ones,
    )  # fmt: skip


def _uniform(u: float, v: float, fps: float = FPS) -> FieldRecord:
    shape = (FRAMES, 100, 100)
    lit = np.zeros(shape, np.uint8)
    return FieldRecord(
        np.full(shape, u, np.float32),
        np.full(shape, v, np.float32),
        lit,
        cell=4,
        fps=fps,
        loop=False,
    )


def _flight(
    scatter: float = 1.0,
    lag: float = 0.0,
    gravity: float = 0.0,
    turbulence: float = 0.0,
    max_alive: int = 1000,
) -> FlightSettings:
    return FlightSettings(1, scatter, lag, gravity, turbulence, 0.0, max_alive, 400, 400)


def _flown(field: FieldRecord, flight: FlightSettings, spawns: Spawns) -> list[ParticleState]:
    return list(fly(spawns, FlightField(field), FRAMES, flight))


@pytest.mark.parametrize("fps", [24.0, 60.0, 23.81, 10.0])
@pytest.mark.parametrize(("u", "v"), [(40.0, -70.0), (0.24, -0.24), (0.0, 0.0)])
def test_a_uniform_field_moves_a_flake_by_v_dt(u: float, v: float, fps: float) -> None:
    for frame, state in enumerate(_flown(_uniform(u, v, fps), _flight(), _spawns(1))):
        assert state.x[0] == pytest.approx(100 + u * frame / fps, abs=1e-4)
        assert state.y[0] == pytest.approx(200 + v * frame / fps, abs=1e-4)


def test_a_lagging_flake_approaches_terminal_fall_under_gravity() -> None:
    lag, gravity = 0.1, 50.0
    last = _flown(_uniform(0, 0), _flight(lag=lag, gravity=gravity), _spawns(1))[-1]
    assert last.vy[0] == pytest.approx(gravity * lag * (1 - math.exp(-1 / lag)), rel=1e-3)


def test_jitter_does_not_depend_on_the_frame_rate() -> None:
    spread = []
    for fps in (12.0, 24.0, 48.0):
        field, flight = _uniform(60, 0, fps), _flight(scatter=0.9)
        frames = int(fps / 2) + 1
        end = list(fly(_spawns(400, x=50), FlightField(field), frames, flight))[-1]
        spread.append(float(np.std(end.y)))
    assert spread[0] > 0
    assert spread == pytest.approx([spread[0]] * 3, rel=1e-6)


def test_a_cold_flake_is_gone_and_a_departed_one_too() -> None:
    states = _flown(_uniform(0, 0), _flight(), _spawns(3, life=0.5))
    assert [len(s.id) for s in states] == [3] * 12 + [0] * 12  # alive while age < 0.5 s
    states = _flown(_uniform(1200, 0), _flight(), _spawns(3))
    assert len(states[3].id) == 3 and len(states[8].id) == 0


def test_no_more_flakes_than_allowed_are_alive() -> None:
    assert max(len(s.id) for s in _flown(_uniform(0, 0), _flight(max_alive=5), _spawns(40))) == 5


def test_flakes_of_one_place_part_by_their_own_turbulence() -> None:
    chance = np.random.default_rng(0)
    spawns = replace(
        _spawns(500),
        turbulence_rate=chance.uniform(0.3, 1.3, 500),
        turbulence_phase_x=chance.uniform(0, 2 * math.pi, 500),
        turbulence_phase_y=chance.uniform(0, 2 * math.pi, 500),
    )
    end = _flown(_uniform(0, 0), _flight(turbulence=10.0), spawns)[-1]
    # ∫√2·10·sin(2π f t + φ) over about a second, averaged over f and φ
    assert 2.0 < np.std(end.x) < 6.0
    assert abs(np.mean(end.x) - 100) < 1.0


def test_a_flake_leaves_with_all_that_is_drawn_of_it() -> None:
    """One that is drawn out over half a second of its way is seen a quarter of a second longer."""
    field, spawns = _uniform(0.0, -400.0), _spawns(1)
    seen = [
        sum(len(state.id) for state in _flown(field, replace(_flight(), streak=streak), spawns))
        for streak in (0.0, 0.5)
    ]
    assert seen[1] - seen[0] == 6  # at 24 frames a second


def test_velocity_is_that_of_the_way_whatever_moves_the_flake() -> None:
    states = _flown(_uniform(30.0, -90.0), _flight(turbulence=60.0), _spawns(1))
    way = np.array([(there.x - here.x)[0] * FPS for here, there in pairwise(states)])
    stated = np.array([state.vx[0] for state in states[:-1]])
    assert np.abs(way - 30).max() > 60
    assert np.abs(stated - way).max() < 20  # turbulence turns it within a frame


def _thrown(fps: float, launch: tuple[float, float], gravity: float = 0.0) -> list[ParticleState]:
    """Return the flight of one spark through gas that rushes to the right."""
    spawns = replace(
        _spawns(1, life=0.99),
        kind=np.full(1, SPARK),
        launch_x=np.full(1, launch[0]),
        launch_y=np.full(1, launch[1]),
        terminal_velocity=np.full(1, 80.0),
    )
    flight = _flight(scatter=0.9, lag=0.01, gravity=gravity, turbulence=50.0)
    return list(fly(spawns, FlightField(_uniform(300.0, 0.0, fps)), round(fps), flight))


@pytest.mark.parametrize("gravity", [0.0, 60.0])
@pytest.mark.parametrize("fps", [24.0, 60.0, 23.81])
def test_a_spark_flies_as_drag_and_gravity_say_whatever_the_gas_does(
    fps: float, gravity: float
) -> None:
    """Against dv/dt = g − d v, integrated by another method (Runge-Kutta, 8th order)."""
    launch, weight = (180.0, -260.0), WEIGHT * 400
    drag = weight / 80

    def change(_: float, state: Sequence[float]) -> list[float]:
        _, _, vx, vy = state
        return [vx, vy, -drag * vx, weight + gravity - drag * vy]

    states = _thrown(fps, launch, gravity)
    times = np.arange(len(states)) / fps
    start = [100.0, 200.0, *launch]
    truth = solve_ivp(change, (0, 1), start, "DOP853", times, rtol=1e-10, atol=1e-10).y
    assert len(states) > 20 and all(len(state.x) for state in states)
    for name, wanted in zip(("x", "y", "vx", "vy"), truth, strict=True):
        found = [getattr(state, name)[0] for state in states]
        assert np.abs(found - wanted).max() < 1e-3


def test_sparks_change_nothing_about_embers() -> None:
    embers = replace(_spawns(40), turbulence_rate=np.linspace(0.1, 0.6, 40))
    kind = np.arange(40) % 2
    both = replace(
        embers, kind=kind, launch_y=np.where(kind, -100.0, 0.0), terminal_velocity=np.full(40, 50.0)
    )
    alone = replace(both, kind=0 * kind)
    flight = _flight(scatter=0.9, turbulence=30.0)
    flown = (_flown(_uniform(20, -50), flight, spawns) for spawns in (both, alone))
    for one, other in zip(*flown, strict=True):
        carried = kind[one.id] == 0
        assert np.array_equal(one.x[carried], other.x[kind[other.id] == 0])


def test_embers_fall_at_their_terminal_velocity_outside_the_flame_alone() -> None:
    spawns = replace(_spawns(1), terminal_velocity=np.full(1, 30.0))
    dark, lit = _uniform(0, -60), _uniform(0, -60)
    lit.brightness[:] = 255
    speeds = [_flown(field, _flight(), spawns)[-1].vy[0] for field in (dark, lit)]
    assert speeds == pytest.approx([-30, -60], abs=0.5)
