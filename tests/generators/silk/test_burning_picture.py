"""A picture that burns: it chars, glows in its gaps, is lit, and hides the flames behind it."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from fire_atlas.core.clip import Window
from fire_atlas.generators.silk.burning_picture import BurningPicture
from fire_atlas.generators.silk.intruder_drawing import Hearth
from fire_atlas.generators.silk.renderer import SilkRenderer, generate_silk
from tests.generators.silk.small_fires import camera, settings, source

SIDE = 96
KEYS: dict[str, Any] = {
    "width": SIDE, "height": SIDE, "foot": 0.1,
    "sheets": {"on": "crate.png", "count": 10, "width": 0.2, "height": 0.4},
}  # fmt: skip
TOP, BOTTOM, LEFT, RIGHT, GAP = 40, 86, 26, 70, 62


def crate(colour: tuple[float, float, float] = (0.3, 0.2, 0.1)) -> BurningPicture:
    """Return two boards, with a gap between them."""
    burns = np.zeros((SIDE, SIDE), np.bool_)
    burns[TOP:BOTTOM, LEFT:RIGHT] = True
    colours = np.where(burns[..., None], colour, 0).astype(np.float32)
    colours[GAP : GAP + 2] *= 0.1
    return BurningPicture(burns, colours)


@cache
def burning(knows_colours: bool = True) -> SilkRenderer:
    picture = crate() if knows_colours else replace(crate(), colours=None)
    return generate_silk(source(**KEYS), settings(3, False), masks={0: picture})


def test_it_is_an_edge_at_its_outline_and_at_its_gaps_alone() -> None:
    edges = crate().edges()
    assert edges[GAP, LEFT + 9 : RIGHT - 9].min() > 0.9 and edges[TOP, LEFT:RIGHT].min() > 0.9
    assert edges[TOP + 6 : GAP - 6, LEFT + 9 : RIGHT - 9].max() == 0
    assert not edges[~crate().burns].any()


def test_most_flames_begin_on_edges() -> None:
    rest = burning().scene.model.rest[:, 0].mean(axis=1)
    x, y = rest[:, 0] * SIDE + SIDE / 2, SIDE * 0.9 - rest[:, 2] * SIDE
    # Each foot is lowered by up to 2.4 px.
    gap, sides = np.abs(y - GAP - 2), np.minimum(np.abs(x - LEFT), np.abs(x - RIGHT))
    ends = np.minimum(np.abs(y - TOP - 1), np.abs(y - BOTTOM - 1))
    assert np.mean(np.minimum(np.minimum(gap, sides), ends) < 4) >= 0.7


def test_char_covers_the_picture_where_flames_begin_and_nothing_else() -> None:
    (seen,) = burning()._seen_pictures(camera(**KEYS))
    feet = burning().pictures[0].feet
    cover = burning().solid_cover(0, camera(**KEYS))
    assert not cover[: TOP - 1].any() and not cover[:, : LEFT - 1].any()
    x, y = feet[:, 0] * SIDE + SIDE / 2, SIDE * 0.9 - feet[:, 1] * SIDE - 5
    inside = (x > LEFT) & (x < RIGHT) & (y > TOP) & (y < BOTTOM)
    near = cover[y[inside].astype(int), x[inside].astype(int)]
    assert near.mean() > 1.3 * cover[TOP:BOTTOM, LEFT:RIGHT].mean()
    assert seen.coverage.max() < 1, "its grain still shows"


def test_gaps_glow_and_the_middle_of_a_board_less() -> None:
    (seen,) = burning()._seen_pictures(camera(**KEYS))
    gap = seen.cracks[2 * GAP : 2 * GAP + 4, 2 * LEFT : 2 * RIGHT].max(axis=0).mean()
    board = seen.cracks[2 * GAP + 12 : 2 * GAP + 24, 2 * LEFT : 2 * RIGHT].max(axis=0).mean()
    assert gap > 2 * board


def test_it_throws_back_the_light_of_flames_near_it_in_its_colours() -> None:
    (seen,) = burning()._seen_pictures(camera(**KEYS))
    hearth = Hearth((0.0, 0.0, 0.0), 0.1, 0.0, 1, ())
    light = np.zeros((2 * SIDE, 2 * SIDE, 3), np.float32)
    dark = seen.lit_by(light, hearth)
    light[100:110, 90:100] = 1
    thrown = seen.lit_by(light, hearth) - dark
    assert thrown[105, 95].min() > 3 * thrown[105, 130].max() > 0
    bare = (seen.coverage == 0) & (seen.colour.min(axis=2) > 0) & (thrown.max(axis=2) > 1e-5)
    ratio = thrown[bare] / thrown[bare][:, :1]
    assert len(ratio) and np.allclose(ratio, [1, 2 / 3, 1 / 3], rtol=0.01)


def test_flames_behind_it_are_hidden_by_it_and_seen_over_it() -> None:
    eye = camera(**KEYS)
    shown, free = np.zeros((2, 2 * SIDE, 2 * SIDE), np.float32)
    for samples, made in ((shown, burning()), (free, replace(burning(), pictures=()))):
        seen = made._seen(1, eye)
        window = Window(*(2 * edge for edge in seen.window))
        samples[window.slices] = seen.flame.max(axis=2)
    inside = np.s_[2 * TOP + 4 : 2 * BOTTOM - 4, 2 * LEFT + 4 : 2 * RIGHT - 4]
    assert shown[inside].sum() < 0.85 * free[inside].sum()
    above = np.s_[: 2 * TOP - 2]
    assert free[above].sum() > 0
    np.testing.assert_allclose(shown[above], free[above], rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("view", [{"azimuth": 90.0}, {"elevation": 20.0}, {"distance": 3.0}])
def test_from_where_it_is_not_the_users_picture_it_is_not_drawn(view: dict[str, float]) -> None:
    assert not burning()._seen_pictures(camera(**view, **KEYS))


def test_a_mask_of_which_nothing_else_is_known_only_burns() -> None:
    assert not burning(False).solid_cover(0, camera(**KEYS)).any()
