"""A fire leans as one body: its axis in space, and what each camera sees of it."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.pixels import brightness
from fire_atlas.generators.profile.generate.axis import BentAxis
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.rendering import renderings, renderings_in_wind
from fire_atlas.recipe.wind import Wind
from fire_atlas.vision.flow import optical_flow
from tests.support.clips import real
from tests.support.likeness import Array, learnt_from, learnt_kite, settings

SPAN = (-0.2, 1.6)

LEANS = st.floats(-0.7, 0.7)


@given(LEANS, LEANS, st.floats(0, 0.6), st.floats(0.05, 1.2))
def test_a_place_goes_to_the_picture_and_back(
    right: float, away: float, elevation: float, widest: float
) -> None:
    axis = BentAxis.of((right, away), elevation, SPAN, widest)
    height, aside = np.meshgrid(np.linspace(-0.1, 1.4, 20), np.linspace(-0.3, 0.3, 9))
    if np.diff(axis.up).min() < 0.3 / 32:
        return  # seen nearly along itself: a px is many heights
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


GUSTS = Wind.model_validate({"gusts": {"mean": 2.5, "strength": 2.5, "period": 0.5}})


@pytest.mark.slow
@pytest.mark.parametrize("elevation", [-30.0, 0.0, 40.0])
@pytest.mark.parametrize(
    "name", ["kite", "candle", "torch", "campfire", real("real_fireplace_gif")]
)
def test_the_camera_holds_a_fire_that_leans_to_any_side(name: str, elevation: float) -> None:
    """In steady wind and in gusts, whose calm moments are higher than what leans."""
    profile = learnt_kite() if name == "kite" else learnt_from(name)
    for wind in (Wind(), Wind(level=5.0), GUSTS):
        fire = GeneratedFire.of(profile, settings(12, wind=wind, loop=False))
        for view in renderings(fire, [0.0, 90.0, 180.0, 270.0], elevation, 64):
            for i in (0, 5, 11):
                alpha = view.frame(i)[..., 3]
                edges = (alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1])
                assert max(float(edge.max()) for edge in edges) < 0.05, (wind, view.camera.azimuth)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["candle", "torch"])
def test_loops_in_several_winds_share_frames_that_hold_all_of_them(name: str) -> None:
    fires = [
        GeneratedFire.of(learnt_from(name), settings(12, wind=Wind(level=level)))
        for level in (0.0, 2.0, 5.0)
    ]
    for view in renderings_in_wind(fires, 0.0, 128):
        for i in (0, 6):
            alpha = view.frame(i)[..., 3]
            assert max(float(edge.max()) for edge in (alpha[0], alpha[:, 0], alpha[:, -1])) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("elevation", [45.0, 60.0, 75.0])
def test_a_candle_blown_towards_a_camera_that_looks_down_stays_in_one_piece(
    elevation: float,
) -> None:
    fire = GeneratedFire.of(learnt_from("candle"), settings(12, wind=Wind(level=5.0), loop=False))
    [view] = renderings(fire, [90.0], elevation, 200)
    _, _, stats, _ = cv2.connectedComponentsWithStats(
        (view.frame(8)[..., 3] > 0.3).astype(np.uint8)
    )
    areas = np.sort(stats[1:, cv2.CC_STAT_AREA])[::-1]
    assert areas[1:].sum() < 0.02 * areas[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["campfire", "torch"])
def test_gas_rises_along_the_axis(name: str) -> None:
    """Also in a wide fire, whose rows stay level: its tongues rise slanting."""
    fire = GeneratedFire.of(learnt_from(name), settings(24, wind=Wind(level=5.0), loop=False))
    [view] = renderings(fire, [0.0], 0.0, 200)
    frames = [view.frame(i) for i in (10, 11)]
    shown = [np.clip(brightness(frame, "srgb"), 0, 255).astype(np.uint8) for frame in frames]
    seen, given = optical_flow(shown[0], shown[1], is_small=True), view.motion(10) / 24
    rises = (shown[0] > 60) & (seen[..., 1] < -1)
    rows = np.flatnonzero(rises.any(axis=1))
    rises[int(np.quantile(rows, 0.6)) :] = False  # above the foot
    angles = [
        math.degrees(math.atan2(flow[rises][:, 0].mean(), -flow[rises][:, 1].mean()))
        for flow in (seen, given)
    ]
    assert angles[1] == pytest.approx(angles[0], abs=8)
