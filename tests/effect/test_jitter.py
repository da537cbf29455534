"""Equation 13 in flight: its distribution, and that its spread does not know the frame rate."""

import math

import numpy as np
import pytest

from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.effect.flakes.emission import Spawns
from fire_atlas.effect.flakes.flight import (
    FlightField,
    FlightSettings,
    fly,
    scatter_rotations,
)
from fire_atlas.effect.flakes.particles import ParticleState
from tests.support.effect import Array

COUNT = 4000


def _distance(values: Array, share_below: Array) -> float:
    """Kolmogorov-Smirnov distance of sorted ``values`` from the distribution they should have."""
    steps = np.arange(len(values) + 1) / len(values)
    return float(max(np.abs(share_below - steps[:-1]).max(), np.abs(share_below - steps[1:]).max()))


@pytest.mark.parametrize("k", [-1.0, -0.6, 0.0, 0.3, 0.9, 0.99])
def test_scatter_rotations_are_those_of_the_closed_form(k: float) -> None:
    turns = [scatter_rotations(5, tick, np.arange(5000), k) for tick in range(8)]
    cosines, sines = (np.concatenate(part) for part in zip(*turns, strict=True))
    if k == -1.0:
        assert np.allclose(cosines, -1) and np.allclose(sines, 0)
        return
    cosines = np.sort(cosines)
    wanted = (1 - k) * (1 + cosines) / (2 * (1 - k * cosines))
    assert _distance(cosines, wanted) < 1.63 / math.sqrt(len(cosines))  # 1 % level
    assert abs(np.mean(sines > 0) - 0.5) < 3 * 0.5 / math.sqrt(len(sines))


def _spawns(count: int = COUNT) -> Spawns:
    one, none = np.ones(count), np.zeros(count)
    return Spawns(
        kind=np.zeros(count, np.int64), tick=np.zeros(count, np.int64), x=200 * one, y=200 * one,
        launch_x=none, launch_y=none, terminal_velocity=none, drift=one, life=9 * one, size=one,
        size_score=none, turbulence_rate=one, turbulence_phase_x=none, turbulence_phase_y=none,
        z=none, launch_z=none, turbulence_phase_z=none,
    )  # fmt: skip


def _field(fps: float) -> FieldRecord:
    """A field that rises at 60 px/s everywhere."""
    shape = (8, 100, 100)
    still, up = np.zeros(shape, np.float32), np.full(shape, -60, np.float32)
    return FieldRecord(still, up, np.zeros(shape, np.uint8), cell=4, fps=fps, loop=False)


def _after_a_second(fps: float, k: float, lag: float) -> ParticleState:
    flight = FlightSettings(3, k, lag, 0.0, 0.0, 0.0, COUNT, 400, 400)
    return list(fly(_spawns(), FlightField(_field(fps)), round(fps) + 1, flight))[-1]


@pytest.mark.parametrize("lag", [0.0, 0.05, 0.5])
@pytest.mark.parametrize("k", [0.5, 0.9, 0.99])
def test_flakes_spread_alike_at_any_frame_rate(k: float, lag: float) -> None:
    spreads = [np.std(_after_a_second(fps, k, lag).x) for fps in (24.0, 60.0)]
    assert spreads[0] > 0.2
    assert spreads[1] == pytest.approx(spreads[0], rel=0.05)


def test_the_more_scatter_the_less_of_the_way_is_made() -> None:
    ways = [60 - (_after_a_second(24.0, k, 0.05).y.mean() - 140) for k in (1.0, 0.99, 0.9, 0.5)]
    assert ways == sorted(ways, reverse=True)
    assert ways[1] > 0.85 * 60


def test_as_many_flakes_fly_as_a_recipe_allows() -> None:
    """OpenCV's remap refuses more than 32766 places in a column."""
    most = 60000
    flight = FlightSettings(3, 0.99, 0.01, 0.0, 0.0, 0.0, most, 400, 400)
    last = list(fly(_spawns(most), FlightField(_field(24.0)), 3, flight))[-1]
    assert len(last.id) == most and np.isfinite(last.x).all()


def test_a_lag_of_next_to_nothing_is_as_good_as_none() -> None:
    """Legal, and small enough for a quotient by it to overflow."""
    assert np.allclose(_after_a_second(24.0, 0.99, 5e-324).x, _after_a_second(24.0, 0.99, 0.0).x)
