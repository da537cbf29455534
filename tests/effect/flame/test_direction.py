"""Lift follows the flame's own motion, and points up wherever that is in doubt."""

import math

import numpy as np
import pytest

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flame.study import study_flame
from fire_atlas.recipe.effect import Features
from tests.support.clips import RISING, RISING_SAMPLES, open_clip, real
from tests.support.effect import AGE, VX, VY, run_effect
from tests.support.fire_kinds import KINDS, streaming


def direction(clip: Clip) -> float:
    """Return where the automatic lift of a clip points, degrees counter-clockwise from right."""
    with Workers(1) as workers:
        x, y = study_flame(clip, Features(), None, workers).buoyancy
    assert math.hypot(x, y) == pytest.approx(1)
    return math.degrees(math.atan2(-y, x)) % 360


def velocity(degrees: float, speed: float) -> tuple[float, float]:
    return speed * math.cos(math.radians(degrees)), speed * math.sin(math.radians(degrees))


@pytest.mark.parametrize("speed", [0.4, 1.1])
@pytest.mark.parametrize("flies", [True, False], ids=["comet", "jet"])
@pytest.mark.parametrize("degrees", [0, 40, 140, 180, 225, 270, 330])
def test_lift_points_where_the_fire_moves(degrees: float, flies: bool, speed: float) -> None:
    found = direction(streaming(velocity(degrees, speed), flies=flies))
    assert (found - degrees + 180) % 360 - 180 == pytest.approx(0, abs=5)


@pytest.mark.parametrize("fps", [16.0, 36.0, 60.0])
def test_at_another_rate_lift_points_the_same_way(fps: float) -> None:
    comet = streaming(velocity(200, 0.8), flies=True)
    x, y = run_effect(comet, {"timeline": {"fps": fps}}).study.buoyancy
    assert math.degrees(math.atan2(-y, x)) % 360 == pytest.approx(200, abs=5)


@pytest.mark.parametrize("degrees", [70, 90, 110])
def test_fire_that_rises_and_leans_is_lifted_straight_up(degrees: float) -> None:
    assert direction(streaming(velocity(degrees, 0.8))) == 90


@pytest.mark.parametrize("name", [*RISING_SAMPLES, *(real(name) for name in RISING)])
def test_of_flames_that_rise_lift_points_up(name: str) -> None:
    assert direction(open_clip(name)) == 90


@pytest.mark.parametrize(
    "name",
    ["gas ring", "candle in a bright room", "lava", "explosion", "sparkler", "smoke without fire"],
)
def test_where_nothing_streams_lift_points_up(name: str) -> None:
    assert direction(KINDS[name]()) == 90


@pytest.mark.parametrize("degrees", [0, 200, 270])
def test_flakes_go_the_way_of_the_fire_that_sheds_them(degrees: float) -> None:
    effect = run_effect(
        streaming(velocity(degrees, 0.8)), {"flakes": {"rate": 300}, "buoyancy": {"turbulence": 0}}
    )
    old = effect.rows[effect.rows[:, AGE] > 0.3]
    x, y = np.median(old[:, VX]), -np.median(old[:, VY])
    turned = math.degrees(math.atan2(y, x)) - degrees
    assert (turned + 180) % 360 - 180 == pytest.approx(0, abs=15)
    # κ, by which flakes are born in the last part of the flame, grows the same way.
    across, down = np.array(velocity(degrees, 1.0)) * (1, -1)
    births = effect.births - np.array([effect.clip.width, effect.clip.height]) / 2
    foot = -0.3 * effect.clip.height
    assert np.median(births @ (across, down)) > foot + 0.2 * effect.clip.height


def test_a_stated_lift_is_not_measured() -> None:
    right = streaming((1.0, 0.0))
    assert run_effect(right, {"buoyancy": {"lift": 1.2}}).study.buoyancy == (0, -1)
    assert run_effect(right, {"buoyancy": {"lift": [-3, 0]}}).study.buoyancy == (-1, 0)
