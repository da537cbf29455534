"""Wind: its level at any moment, and flakes that lean with it."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from fire_atlas.effect.field.eddies import Eddies
from fire_atlas.effect.field.wind import (
    LEVEL_SPEED,
    AmbientFlow,
    fit_gusts,
    wind_in_view,
    wind_velocity,
)
from fire_atlas.recipe.effect import Buoyancy
from fire_atlas.recipe.wind import Wind
from tests.support.clips import campfire, clip_of
from tests.support.effect import EffectRun, X, run_effect


def _wind(**keys: Any) -> Wind:
    return Wind.model_validate(keys)


@pytest.mark.parametrize(
    ("direction", "share"),
    [
        ("right", 1.0),
        ("left", -1.0),
        (0.0, 1.0),
        (60.0, 0.5),
        (90.0, 0.0),
        (180.0, -1.0),
        (-120.0, -0.5),
    ],
)
def test_a_steady_wind_is_what_the_image_shows_of_it(direction: str | float, share: float) -> None:
    wind = _wind(level=4.0, direction=direction)
    for time in (-2.0, 0.0, 17.3):
        assert wind_velocity(wind, time)[0] == pytest.approx(4 * share, abs=1e-9)


def test_keyframes_change_evenly_and_hold_before_and_after() -> None:
    wind = _wind(
        keyframes=[
            {"t": 1.0, "level": 1.0},
            {"t": 3.0, "level": 5.0},
            {"t": 4.0, "level": 2.0, "direction": "left"},
        ]
    )
    known = {-1.0: 1.0, 1.0: 1.0, 2.0: 3.0, 3.0: 5.0, 3.5: 1.5, 4.0: -2.0, 90.0: -2.0}
    for time, level in known.items():
        assert wind_velocity(wind, time)[0] == pytest.approx(level)


def test_keyframes_at_one_moment_are_a_jump() -> None:
    wind = _wind(keyframes=[{"t": 0, "level": 1}, {"t": 1, "level": 1}, {"t": 1, "level": 4}])
    assert wind_velocity(wind, 0.999)[0] == pytest.approx(1.0, abs=0.01)
    assert wind_velocity(wind, 1.001)[0] == pytest.approx(4.0, abs=0.01)


def _gusts(mean: float, strength: float, period: float = 2.0) -> np.ndarray[Any, Any]:
    wind = _wind(gusts={"mean": mean, "strength": strength, "period": period})
    return np.array([wind_velocity(wind, t)[0] for t in np.linspace(0, period, 2001)])


def test_gusts_swing_around_their_mean_by_their_strength() -> None:
    level = _gusts(mean=3.0, strength=1.5)
    assert level.mean() == pytest.approx(3.0, abs=0.01)
    assert level.max() == pytest.approx(4.5, abs=0.03)
    assert level.min() == pytest.approx(1.5, abs=0.03)


@pytest.mark.parametrize("period", [0.3, 0.7, 2.0, 5.0])
def test_the_gusts_around_a_loop_close_with_it(period: float) -> None:
    wind = _wind(gusts={"mean": 3.0, "strength": 2.0, "period": period})
    clip = clip_of([np.zeros((32, 32, 4), np.float32)] * 24)
    loop = AmbientFlow.of(wind, Buoyancy(turbulence=0.0), replace(clip, loop=True), seed=1)
    speeds = [loop.velocity(t, (2, 2))[0][0, 0] for t in np.arange(0, 2, 1 / 24)]
    assert np.allclose(speeds[:24], speeds[24:], rtol=1e-5)
    assert np.ptp(speeds) > 0.8 * 4.0 * LEVEL_SPEED * clip.height


def test_a_gust_swells_faster_than_it_falls() -> None:
    level = _gusts(mean=3.0, strength=1.5)
    steps = np.diff(level)
    assert steps.max() > -steps.min()


def test_gusts_begin_anew_every_period_and_never_blow_back() -> None:
    wind = _wind(gusts={"mean": 0.5, "strength": 4.0, "period": 1.3})
    for time in np.linspace(0, 1.3, 40):
        assert wind_velocity(wind, time + 3 * 1.3)[0] == pytest.approx(wind_velocity(wind, time)[0])
        assert wind_velocity(wind, time)[0] >= 0


@pytest.mark.parametrize(
    "keys",
    [
        {"level": 3.5, "direction": 120.0},
        {"gusts": {"mean": 2.0, "strength": 1.5, "period": 1.0}, "direction": -40.0},
        {"keyframes": [{"t": 0, "level": 1.0}, {"t": 1, "level": 4.0, "direction": "left"}]},
        {},
    ],
)
def test_the_peak_level_is_reached_and_never_exceeded(keys: dict[str, Any]) -> None:
    wind = _wind(**keys)
    levels = [float(np.hypot(*wind_velocity(wind, t))) for t in np.linspace(0, 2, 2001)]
    assert max(levels) == pytest.approx(wind.peak, abs=1e-3)


@pytest.mark.parametrize(("duration", "gusts"), [(4.0, 3), (2.0, 2), (0.4, 1)])
def test_gusts_that_are_fitted_close_with_their_loop(duration: float, gusts: int) -> None:
    wind = fit_gusts(_wind(gusts={"mean": 1.0, "strength": 1.0, "period": 1.3}), duration)
    assert wind.gusts is not None
    assert wind.gusts.period == pytest.approx(duration / gusts)
    assert wind_velocity(wind, duration) == pytest.approx(wind_velocity(wind, 0.0))
    assert fit_gusts(_wind(level=2.0), duration) == _wind(level=2.0)


def test_calm_air_is_the_default() -> None:
    assert wind_velocity(Wind(), 1.0) == (0.0, 0.0)


def test_a_level_is_a_known_speed_of_the_air_around() -> None:
    still = Eddies.random(0, 50, 0.0)
    u, v = AmbientFlow(still, _wind(level=2.0), 200).velocity(0.5, (50, 40))
    assert np.allclose(u, 2 * LEVEL_SPEED * 200) and not v.any()


@cache
def _blown(level: float, direction: float) -> EffectRun:
    keys = {
        "wind": {"level": level, "direction": direction},
        "flakes": {"rate": 150},
        "timeline": {"loop": "none"},
    }
    return run_effect(campfire(128), keys)


def _drift(effect: EffectRun) -> float:
    """Mean way to the right of flakes from their first row to their last, heights."""
    return float(np.mean([f[-1, X] - f[0, X] for f in effect.flights(4)])) / effect.clip.height


@pytest.mark.slow
def test_flakes_lean_with_the_wind_and_more_in_a_stronger_one() -> None:
    drifts = [_drift(_blown(level, 0.0)) for level in (0.0, 1.0, 2.5, 5.0)]
    assert drifts == sorted(drifts)
    assert drifts[-1] > drifts[0] + 0.1
    assert _drift(_blown(5.0, 180.0)) < drifts[0] - 0.1


def test_wind_that_blows_away_from_the_eye_does_not_bend_the_plume() -> None:
    assert _drift(_blown(5.0, 90.0)) == pytest.approx(_drift(_blown(0.0, 0.0)), abs=0.01)


@pytest.mark.parametrize(
    ("azimuth", "right", "away"), [(0, 3, 0), (90, 0, -3), (180, -3, 0), (270, 0, 3)]
)
def test_an_eye_that_walks_round_the_fire_sees_the_wind_turn(
    azimuth: float, right: float, away: float
) -> None:
    """At 90° it stands to the right, where a wind from the left blows into its face."""
    keyframes = [{"t": 0, "level": 3.0}, {"t": 1, "level": 3.0}]
    for wind in (_wind(level=3.0), _wind(keyframes=keyframes)):
        assert wind_velocity(wind_in_view(wind, azimuth), 0.5) == pytest.approx(
            (right, away), abs=1e-9
        )
