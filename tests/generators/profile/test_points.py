"""Outline, six points, lean and states of flames of which all is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.generators.profile.learn.features import contour, feature_points, flame_lean
from fire_atlas.generators.profile.learn.learn import leaning_sets
from fire_atlas.generators.profile.model import STATE_EDGES, leaning_state
from tests.generators.profile.flames import BASE, FOOT, HEIGHT, TIP, WIDTH, kite, points


@pytest.mark.parametrize("lean", [-25.0, -10.0, 0.0, 4.0, 17.0])
@pytest.mark.parametrize("half", [14.0, 20.0, 33.0])
def test_the_six_points_of_a_known_flame_are_found(lean: float, half: float) -> None:
    flame = kite(lean, half)
    found, wanted = feature_points(flame), points(lean, half)
    assert np.abs(np.array(found) - np.array(wanted)).max() <= 1.0, (found, wanted)
    assert flame_lean(flame) == pytest.approx(lean, abs=1.0)


@settings(max_examples=40, deadline=None)
@given(lean=st.floats(-30, 30), half=st.floats(12, 40))
def test_lean_height_and_width_hold_for_any_kite(lean: float, half: float) -> None:
    flame = kite(lean, half)
    found = feature_points(flame)
    assert flame_lean(flame) == pytest.approx(lean, abs=1.0)
    assert found.height == pytest.approx(BASE - TIP, abs=2.0)
    assert found.width == pytest.approx(2 * half, abs=2.0)


def test_the_outline_is_the_edge_of_the_flame_and_nothing_else() -> None:
    square = np.zeros((12, 12), np.bool_)
    square[3:9, 2:8] = True
    inner = np.zeros_like(square)
    inner[4:8, 3:7] = True
    assert (contour(square) == (square & ~inner)).all()


def test_what_the_frame_cuts_off_is_an_edge() -> None:
    assert contour(np.ones((5, 4), np.bool_)).sum() == 14


def test_a_foot_of_two_ends_stands_between_them() -> None:
    flame = np.zeros((HEIGHT, WIDTH), np.bool_)
    flame[60:188, 60:100] = True
    flame[188:200, 70:73] = True
    flame[188:199, 87:90] = True
    assert feature_points(flame).bottom[0] == pytest.approx(FOOT, abs=0.6)


def test_twelve_sets_answer_whatever_the_clip_shows() -> None:
    leans = np.array([math.sin(i / 3) * 8 for i in range(30)])
    sets = leaning_sets(leans)
    assert len(sets) == 12
    assert [each.low for each in sets[::2]] == list(STATE_EDGES[:-1])
    assert all(each.frames for each in sets)


def test_a_set_has_the_frames_of_its_lean_or_says_whose_it_has() -> None:
    # It leans more and more, by turns slowly and quickly.
    leans = np.cumsum(np.tile(np.repeat([0.1, 0.4], 10), 6)) - 0.05
    for each in leaning_sets(leans):
        shown = leans[list(each.frames)]
        if each.low >= 0:
            assert each.origin == "own"
        if each.origin == "own":
            assert ((shown >= each.low) & (shown < each.high)).all()
        elif each.origin == "mirrored":
            assert ((-shown >= each.low) & (-shown < each.high)).all()
    assert {each.origin for each in leaning_sets(leans)} == {"own", "mirrored"}


def test_a_state_nobody_showed_takes_those_that_lean_most_like_it() -> None:
    sets = leaning_sets(np.array([0.0, 1, 2, 3, 4, 5, 6, 7, 8, 9]))
    outermost = sets[-1]
    assert (outermost.low, outermost.origin) == (20.0, "sheared")
    assert 9 in outermost.frames or 8 in outermost.frames


@pytest.mark.parametrize(
    ("lean", "state"), [(-99, 0), (-25, 0), (-10.1, 1), (-1, 2), (0, 3), (25, 5), (80, 5)]
)
def test_the_state_of_a_lean(lean: float, state: int) -> None:
    assert leaning_state(lean) == state
