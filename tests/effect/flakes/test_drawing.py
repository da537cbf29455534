"""Drawn flakes give the light they should, where they should."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fire_atlas.effect.flakes.appearance import EMBER_LIGHT
from fire_atlas.effect.flakes.drawing import (
    HALO_LIGHT,
    HALO_WIDTH,
    SPRITE_INTEGRAL,
    add_glow,
    draw_flakes,
    draw_frame,
    draw_pixels,
)
from fire_atlas.effect.flakes.layer import FAINTEST
from fire_atlas.effect.flakes.texture import TextureCells
from fire_atlas.effect.flakes.tracks import COLUMNS

Light = NDArray[np.float64]

WITH_HALO = 1 + HALO_LIGHT * HALO_WIDTH**2
"""Light of a round flake with its halo, relative to that without."""


def row(**values: float) -> NDArray[np.float64]:
    """Return the table of one flake."""
    usual = dict.fromkeys(COLUMNS, 0.0) | {
        "x": 50.0, "y": 40.0, "size": 6.0, "stretch": 1.0, "r": 2.0, "g": 1.0, "b": 0.5, "a": 1.0,
        "tail": 1.0,
    }  # fmt: skip
    return np.array([[(usual | values)[name] for name in COLUMNS]])


def stated(rows: NDArray[np.float64], height: int, width: int, halo: bool = True) -> Light:
    """Return the light (height, width, 3) that the documentation of ``Tracks`` states, computed
    at the centre of each pixel."""
    y, x = np.mgrid[:height, :width] + 0.5
    total = np.zeros((height, width, 3))
    for values in rows:
        flake = dict(zip(COLUMNS, values, strict=True))
        cos, sin = math.cos(flake["rotation"]), math.sin(flake["rotation"])
        dx, dy = x - flake["x"], y - flake["y"]
        half_width, half_length = flake["size"] / 2, flake["size"] * flake["stretch"] / 2
        for wider, light in ((1, 1.0), *(((HALO_WIDTH, HALO_LIGHT),) if halo else ())):
            more = half_width * (wider - 1)
            u = (dx * cos + dy * sin) / (half_length + more)
            v = (dy * cos - dx * sin) / (half_width + more)
            rise = flake["tail"] + (1 - flake["tail"]) * (1 + u) / 2
            shine = np.maximum(1 - np.abs(u) ** 3 - v**2, 0) ** 3 * rise * light * flake["a"]
            total += shine[..., None] * [flake[name] for name in "rgb"]
    return total


@settings(max_examples=60, deadline=None)
@example(x=30.625, y=30.0, size=1.75, stretch=1.125, rotation=0.0, tail=0.0)
@given(
    x=st.floats(60, 100), y=st.floats(60, 100), size=st.floats(1.6, 20), stretch=st.floats(1, 4),
    rotation=st.floats(-math.pi, math.pi), tail=st.floats(0, 1),
)  # fmt: skip
def test_a_flake_gives_the_same_light_wherever_it_falls_on_the_pixels(
    x: float, y: float, size: float, stretch: float, rotation: float, tail: float
) -> None:
    rows = row(x=x, y=y, size=size, stretch=stretch, rotation=rotation, tail=tail)
    light = draw_flakes(rows, 200, 200).rgb().sum(axis=(0, 1))
    core = SPRITE_INTEGRAL * stretch * size**2
    halo = SPRITE_INTEGRAL * (stretch + HALO_WIDTH - 1) * HALO_WIDTH * size**2
    # The halo is cut off where it is too faint to be seen.
    mean = (1 + tail) / 2
    least, most = core * mean, (core + HALO_LIGHT * halo) * mean
    assert (light >= np.array([2, 1, 0.5]) * least * 0.998).all()
    assert (light <= np.array([2, 1, 0.5]) * most * 1.002).all()


@pytest.mark.parametrize("size", [3.0, 7.0, 24.0])
@pytest.mark.parametrize("stretch", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("rotation", [0.0, 0.7, math.pi / 2, -2.5])
def test_pixels_are_as_the_tracks_state(size: float, stretch: float, rotation: float) -> None:
    tail = 0.4 if stretch > 1 else 1.0
    rows = row(size=size, stretch=stretch, rotation=rotation, tail=tail, x=50.3, y=40.8)
    drawn, wanted = draw_flakes(rows, 80, 100).rgb(), stated(rows, 80, 100)
    assert np.abs(drawn - wanted).sum() < 0.03 * wanted.sum()


def test_one_pixel_of_one_ember_in_closed_form() -> None:
    """A quarter of its length and of its width from the middle, and no part of it beyond half."""
    rows = row(x=50.5, y=40.5, size=32, r=0.1, g=0.0, b=0.0)
    light = draw_flakes(rows, 80, 100).rgb()[..., 0]
    assert light[40, 50] == pytest.approx(0.1, rel=1e-5)
    assert light[40, 58] == pytest.approx(0.1 * (1 - 1 / 8) ** 3, rel=1e-5)
    assert light[48, 50] == pytest.approx(0.1 * (1 - 1 / 4) ** 3, rel=1e-5)
    assert light[40, 67] == light[57, 50] == 0


def test_a_streak_fades_towards_its_ends_and_further_towards_its_tail() -> None:
    rows = row(x=50.5, y=40.5, size=16, stretch=5, tail=0.25, r=0.1, g=0.0, b=0.0)
    light = draw_flakes(rows, 80, 100).rgb()[40, :, 0]
    ends = (1 - 1 / 8) ** 3  # half of the way to the ends, 20 px off the middle
    assert light[[30, 50, 70]] == pytest.approx([0.04375 * ends, 0.0625, 0.08125 * ends], rel=1e-4)
    assert (np.diff(light[61:90]) < 0).all() and (np.diff(light[11:58]) > 0).all()


def test_a_streak_is_thinner_the_nearer_to_its_ends() -> None:
    rows = row(x=50.5, y=40.5, size=16, stretch=5, r=0.1, g=0.0, b=0.0)
    seen = draw_flakes(rows, 80, 100).rgb()[..., 0] > 0.01
    assert seen[:, [50, 66, 74, 82]].sum(axis=0).tolist() == [11, 11, 9, 3]


def test_the_centre_of_light_is_the_flakes_place() -> None:
    light = draw_flakes(row(x=50.3, y=40.8, stretch=2.0, rotation=0.7), 100, 100).rgb()[..., 0]
    y, x = np.mgrid[:100, :100] + 0.5
    assert (light * x).sum() / light.sum() == pytest.approx(50.3, abs=0.08)
    assert (light * y).sum() / light.sum() == pytest.approx(40.8, abs=0.08)


def test_a_streak_lies_along_its_rotation_clockwise_on_screen() -> None:
    rows = row(stretch=5.0, rotation=math.pi / 4, size=8)
    light = draw_flakes(rows, 100, 100).rgb()[..., 0]
    assert light[48, 58] > 0.5 and light[32, 58] < 0.01  # down-right is lit, up-right is not


def test_the_light_of_flakes_adds_up_and_may_exceed_one() -> None:
    one, other = row(), row(x=53.0, r=0.5, g=2.0, rotation=1.0, stretch=2.0)
    alone = draw_flakes(one, 100, 100).rgb() + draw_flakes(other, 100, 100).rgb()
    both = draw_flakes(np.vstack([one, other]), 100, 100).rgb()
    assert np.allclose(both, alone, atol=1e-4) and both.max() > 2
    three = draw_flakes(np.vstack([one] * 3), 100, 100).rgb()
    assert np.allclose(three, 3 * draw_flakes(one, 100, 100).rgb(), atol=2e-3) and three.max() > 5


def test_a_halo_has_four_thousandths_of_the_light() -> None:
    light = draw_flakes(row(x=50.5, y=40.5, size=10, r=20.0), 100, 100).rgb()[..., 0]
    ring = light[48, 50]  # 8 px away: 0.64 of the halo's radius
    assert ring / 20 == pytest.approx(HALO_LIGHT * (1 - 0.64**2) ** 3, rel=0.05)
    assert light[40, 50] / 20 == pytest.approx(1 + HALO_LIGHT, rel=1e-3)
    assert light.sum() / 20 == pytest.approx(SPRITE_INTEGRAL * 100 * WITH_HALO, rel=0.01)
    assert abs(light[40, 71]) < FAINTEST and light[40, 73] == 0


@pytest.mark.parametrize("strength", [0.2, 0.6, 5.0, 14.0, 80.0])
@pytest.mark.parametrize("size", [4.0, 8.0, 30.0])
def test_halos_are_as_stated_though_wide_ones_are_drawn_at_lower_resolutions(
    strength: float, size: float
) -> None:
    rows = row(x=90.2, y=80.9, size=size, stretch=2.0, rotation=0.4, tail=0.6, r=strength)
    many = np.vstack([rows, row(x=-900.0, size=120.0)])  # too few would all be drawn at the frame's
    drawn = draw_flakes(many, 161, 183).rgb()[..., 0]
    wanted, bare = (stated(rows, 161, 183, halo)[..., 0] for halo in (True, False))
    outside = bare == 0
    assert wanted[outside].max() > 3e-4
    assert (np.abs(drawn - wanted) < 2 * FAINTEST + 0.01 * wanted)[outside].all()


def test_embers_of_one_colour_need_one_plane() -> None:
    colour = dict(zip("rgb", EMBER_LIGHT, strict=True))
    rows = np.vstack([row(**colour, a=0.3), row(**{c: 7 * v for c, v in colour.items()}, x=20.0)])
    one = draw_flakes(rows, 80, 100)
    assert len(one.planes) == 1
    assert one.colours == pytest.approx(np.array([EMBER_LIGHT]))
    several = draw_flakes(np.vstack([rows, row(x=-500.0)]), 80, 100)
    assert len(several.planes) == 3
    assert np.allclose(one.rgb(), several.rgb(), atol=1e-5)


def test_lit_pixels_are_those_that_can_be_seen() -> None:
    layer = draw_flakes(row(), 80, 100)
    assert np.array_equal(layer.touched(), np.flatnonzero(layer.rgb().max(axis=2) > 4e-4))


def test_a_flake_that_leaves_the_frame_is_cut_not_piled_up_at_its_border() -> None:
    whole = draw_flakes(row(size=10), 100, 100).rgb()
    cut = draw_flakes(row(x=0.0, size=10), 100, 100).rgb()
    assert cut.sum() == pytest.approx(whole.sum() / 2, rel=0.01)


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (7, 5), (64, 1)])
def test_frames_of_any_size_take_flakes_and_halos(size: tuple[int, int]) -> None:
    layer = draw_flakes(row(x=0.5, y=0.5, r=9.0), *size)
    assert layer.rgb().shape == (*size, 3) and layer.rgb()[0, 0, 0] > 1


def test_no_flakes_is_black() -> None:
    nothing = np.empty((0, len(COLUMNS)))
    assert not draw_flakes(nothing, 5, 7).rgb().any()
    assert not draw_pixels(nothing, 5, 7).rgb().any()


@pytest.mark.parametrize("kind", ["soft", "hard", "textured"])
def test_what_of_a_flake_is_beyond_a_side_of_a_tile_is_drawn_at_the_other(kind: str) -> None:
    chance = np.random.default_rng(6)
    sizes = [2.0, 6.0, 40.0, 4.0, 9.0]
    places = [0.4, 95.0, 3.3, 96.0 + 50, -960.0 + 94]
    rows = np.concatenate([
        row(x=x, size=size, stretch=stretch, rotation=angle, tail=0.5)
        for x, size, stretch, angle in zip(
            places, sizes, [1, 3, 1, 40, 2], [0, 0.3, 1, 0, -0.6], strict=True
        )
    ])  # fmt: skip
    texture = TextureCells(chance.random((2, 5, 8, 1), np.float32), over_life=False)
    cells = np.array([0, 1, 0, 1, 0]) if kind == "textured" else None

    def drawn(right: float) -> Light:
        moved = rows.copy()
        moved[:, COLUMNS.index("x")] += right
        shown = texture if kind == "textured" else None
        light = draw_frame(moved, 80, 96, kind == "hard", shown, cells, tiles=True)
        return add_glow(light, 0.5, fades=True, tiles=True).rgb().astype(float)

    inside = np.roll(drawn(-48.0), 48, axis=1)
    assert np.abs(inside[:, [0, -1]]).max() > 0.5
    assert np.abs(drawn(0.0) - inside).max() < 2 * FAINTEST
