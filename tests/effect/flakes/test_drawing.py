"""Drawn flakes give the light they should, where they should."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.effect.flakes.drawing import draw_flakes
from fire_atlas.effect.flakes.tracks import COLUMNS


def _row(**values: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    usual = dict.fromkeys(COLUMNS, 0.0) | {
        "x": 50.0, "y": 40.0, "size": 6.0, "stretch": 1.0, "r": 2.0, "g": 1.0, "b": 0.5, "a": 1.0,
    }  # fmt: skip
    return np.array([[(usual | values)[name] for name in COLUMNS]])


@settings(max_examples=60, deadline=None)
@given(
    x=st.floats(30, 70), y=st.floats(30, 50), size=st.floats(2.6, 20), stretch=st.floats(1, 4),
    rotation=st.floats(-math.pi, math.pi),
)  # fmt: skip
def test_a_flake_gives_the_same_light_wherever_it_falls_on_the_pixels(
    x: float, y: float, size: float, stretch: float, rotation: float
) -> None:
    rows = _row(x=x, y=y, size=size, stretch=min(stretch, 50 / size), rotation=rotation)
    light = draw_flakes(rows, 160, 180)
    stretch = float(rows[0, COLUMNS.index("stretch")])
    # the integral of (1 − q²)² over an ellipse of half axes A and B is π A B / 3
    wanted = math.pi / 3 * (size / 2) * (size * stretch / 2)
    assert light.sum(axis=(0, 1)) == pytest.approx(np.array([2, 1, 0.5]) * wanted, rel=1e-3)


def test_the_centre_of_light_is_the_flakes_place() -> None:
    light = draw_flakes(_row(x=50.3, y=40.8, stretch=2.0, rotation=0.7), 100, 100)[..., 0]
    y, x = np.mgrid[:100, :100] + 0.5
    assert (light * x).sum() / light.sum() == pytest.approx(50.3, abs=0.08)
    assert (light * y).sum() / light.sum() == pytest.approx(40.8, abs=0.08)


def test_a_streak_lies_along_its_rotation_clockwise_on_screen() -> None:
    light = draw_flakes(_row(stretch=5.0, rotation=math.pi / 4, size=8), 100, 100)[..., 0]
    assert light[52, 62] > 0 and light[28, 62] == 0  # down-right is lit, up-right is not


def test_flakes_add_up_and_may_exceed_one() -> None:
    one = draw_flakes(_row(), 100, 100)
    three = draw_flakes(np.vstack([_row()] * 3), 100, 100)
    assert np.allclose(three, 3 * one, rtol=1e-5) and three.max() > 3


def test_a_flake_that_leaves_the_frame_is_cut_not_piled_up_at_its_border() -> None:
    whole = draw_flakes(_row(size=10), 100, 100)
    cut = draw_flakes(_row(x=0.0, size=10), 100, 100)
    assert cut.sum() == pytest.approx(whole.sum() / 2, rel=0.01)


def test_no_flakes_is_black() -> None:
    assert not draw_flakes(np.empty((0, 14)), 5, 7).any()
