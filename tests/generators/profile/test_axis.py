"""A fire leans as one body: its axis in space, and what each camera sees of it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.generators.profile.generate.axis import BentAxis
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.rendering import renderings
from fire_atlas.recipe.wind import Wind
from tests.generators.profile.likeness import Array, learnt_from, learnt_kite, settings

SPAN = (-0.2, 1.6)

LEANS = st.floats(-0.7, 0.7)


@given(LEANS, LEANS, st.floats(0, 0.6), st.floats(0.05, 1.2))
def test_a_place_goes_to_the_picture_and_back(
    right: float, away: float, elevation: float, widest: float
) -> None:
    axis = BentAxis.of((right, away), elevation, SPAN, widest)
    height, aside = np.meshgrid(np.linspace(-0.1, 1.4, 20), np.linspace(-0.3, 0.3, 9))
    if (axis.up[1:] - axis.up[:-1]).min() < 0.005:
        return  # seen along its axis: several heights are at one place
    found = axis.straightened(*axis.placed(height, aside))
    assert np.abs(found[0] - height).max() < 0.01 and np.abs(found[1] - aside).max() < 0.01


@pytest.mark.parametrize("lean", [0.0, 10.0, 20.0, 30.0])
def test_the_line_from_the_base_to_the_top_leans_by_the_lean(lean: float) -> None:
    axis = BentAxis.of((math.radians(lean), 0.0), 0.0, SPAN, 0.2)
    x, y = (axis.at(values, np.array([1.0]))[0] for values in (axis.right, axis.up))
    assert math.degrees(math.atan2(x, y)) == pytest.approx(lean, abs=0.2)
    low, _ = (axis.at(values, np.array([0.2]))[0] for values in (axis.right, axis.up))
    assert low < 0.03, "the foot stays"
    length = np.hypot(np.diff(axis.right), np.diff(axis.up)).sum()
    assert length == pytest.approx(axis.heights[-1] - axis.heights[0], rel=1e-3)


def _tops(lean: float, elevation: float) -> dict[int, float]:
    """Return how far above the base the top is seen from four sides, flame heights, of a fire that
    leans to the right of the front."""
    tops = {}
    for azimuth in (0, 90, 180, 270):
        turn = math.radians(azimuth)
        seen = math.radians(lean) * math.cos(turn), -math.radians(lean) * math.sin(turn)
        axis = BentAxis.of(seen, math.radians(elevation), SPAN, 0.2)
        tops[azimuth] = float(axis.at(axis.up, np.array([1.0]))[0])
    return tops


@pytest.mark.parametrize("elevation", [15.0, 30.0, 45.0])
def test_what_leans_towards_a_camera_that_looks_down_ends_lower(elevation: float) -> None:
    tops, lean = _tops(30.0, elevation), math.radians(30)
    # At 90° the camera stands to the right: the fire leans towards it.
    apart = 2 * math.sin(lean) * math.sin(math.radians(elevation))
    assert tops[270] - tops[90] == pytest.approx(apart, rel=0.1)
    assert tops[0] == pytest.approx(tops[180], abs=1e-9)


def _heights(name: str, azimuths: list[float], elevation: float, wind: Wind) -> Array:
    """Return how high the flame is seen over its base, flame heights, from each side: the mean of
    the highest places with light in several frames."""
    profile = learnt_from(name)
    fire = GeneratedFire.of(profile, settings(24, wind=wind, loop=False))
    tops = []
    for view in renderings(fire, azimuths, elevation, None):
        found = []
        for i in range(12, 24, 3):
            rows = np.flatnonzero((view.frame(i)[..., 3] > 0.3).any(axis=1))
            found.append((view.camera.origin[1] - rows[0]) / view.camera.scale)
        tops.append(np.mean(found))
    return np.array(tops)


@pytest.mark.slow
def test_a_candle_in_wind_is_drawn_as_it_leans() -> None:
    """Its tops from 90° and 270° at an elevation of 30° differ by 2 sin L sin(elevation) of the
    height at which light is seen of it."""
    [height] = _heights("candle", [90.0], 0.0, Wind())
    towards, away = _heights("candle", [90.0, 270.0], 30.0, Wind(level=5.0))
    apart = 2 * height * math.sin(math.radians(30)) * math.sin(math.radians(30))
    assert away - towards == pytest.approx(apart, rel=0.1)


@pytest.mark.slow
def test_rows_of_a_slender_fire_turn_with_its_axis() -> None:
    """What rises in it is not cut into steps: pieces keep their proportions."""

    def elongation(wind: Wind) -> float:
        fire = GeneratedFire.of(learnt_from("torch"), settings(32, wind=wind, loop=False))
        [view] = renderings(fire, [0.0], 0.0, 240)
        found = []
        for i in range(12, 32, 4):
            y, x = np.nonzero(view.frame(i)[..., 3] > 0.4)
            found.append(np.linalg.cond(np.cov(np.stack([x, y]))))
        return float(np.sqrt(np.mean(found)))

    assert elongation(Wind(level=5.0)) < 1.15 * elongation(Wind())


def test_a_wide_fire_keeps_its_rows_level() -> None:
    narrow, wide = (BentAxis.of((0.5, 0.0), 0.0, SPAN, widest) for widest in (0.3, 1.0))
    assert narrow.turn.max() > 0.7 and not wide.turn.any()


def test_the_camera_holds_a_fire_that_leans_to_any_side() -> None:
    fire = GeneratedFire.of(learnt_kite(), settings(16, wind=Wind(level=5.0), loop=False))
    for elevation in (0.0, 40.0):
        for view in renderings(fire, [0.0, 90.0, 180.0, 270.0], elevation, 160):
            alpha = view.frame(12)[..., 3]
            edges = (alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1])
            assert max(float(edge.max()) for edge in edges) < 0.02
