"""A texture is drawn where and as the tracks say: turned, stretched, masked or as painted."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.pixels import decode_bytes, expose
from fire_atlas.effect.flakes.replay import cross_faded
from fire_atlas.effect.flakes.texture import TextureCells, draw_textured
from fire_atlas.effect.flakes.tracks import (
    COLUMNS,
    SPAWN_COLUMNS,
    Tracks,
    TrackTexture,
    first_frames,
    fold_into_loop,
)
from tests.support.embers import ember
from tests.support.textures import COLOURS, drop

SIDE = 100
FIRST = np.zeros(1, np.int64)


def mask_of(picture: NDArray[np.uint8]) -> TextureCells:
    """The coverage of a picture as a mask."""
    return TextureCells(
        picture[None, ..., 3:].astype(np.float32) / np.float32(255), over_life=False
    )


def painted_with(*colours: tuple[int, int, int]) -> TextureCells:
    """Cells of 8 x 8 px, each of one colour."""
    light = decode_bytes(np.array(colours, np.uint8).reshape(-1, 1, 1, 3))
    return TextureCells(np.tile(light, (1, 8, 8, 1)), over_life=False)


def drawn(row: NDArray[np.float64], texture: TextureCells, cell: int = 0) -> NDArray[np.float32]:
    return draw_textured(row[None], FIRST + cell, texture, SIDE, SIDE).rgb()


def moments(light: NDArray[np.float32]) -> tuple[NDArray[np.float64], float]:
    """Return the centre (x, y) and the axis (rad) of a picture's light."""
    weight = light.sum(axis=2) / light.sum()
    y, x = np.mgrid[: len(light), : len(light)] + 0.5
    centre = np.array([(weight * x).sum(), (weight * y).sum()])
    off = np.stack([x - centre[0], y - centre[1]])
    _, axes = np.linalg.eigh(np.einsum("hw,ahw,bhw->ab", weight, off, off))
    return centre, float(np.arctan2(axes[1, 1], axes[0, 1]))


@pytest.mark.parametrize("size", [4.0, 9.5, 22.0])
def test_the_axis_of_the_picture_is_that_of_the_flight_and_its_head_leads(size: float) -> None:
    texture = mask_of(drop())
    for rotation in np.linspace(-3.1, 3.1, 17):
        row = ember(1.0, size, stretch=2.67, rotation=float(rotation))
        centre, axis = moments(drawn(row, texture))
        error = (axis - rotation + np.pi / 2) % np.pi - np.pi / 2
        assert abs(np.degrees(error)) < 2
        # Most of a drop is its head.
        ahead, aside = np.array(
            [[np.cos(rotation), np.sin(rotation)], [-np.sin(rotation), np.cos(rotation)]]
        ) @ (centre - [49.6, 50.3])
        assert 0.1 < ahead / (2.67 * size) < 0.25 and abs(aside) < 0.1


def test_a_cell_fills_its_rectangle() -> None:
    row = ember(1.0, 20.0, stretch=3.0, rotation=0.0, x=50.0, y=50.0)
    light = drawn(row, TextureCells(np.ones((1, 6, 6, 1), np.float32), False))[..., 0]
    assert (light[45:55, 30:70] > 0.9).all()
    assert ((light[50] > 0.5).sum(), (light[:, 50] > 0.5).sum()) == (60, 20)


@pytest.mark.parametrize("size", [1.5, 2.2, 4.0, 11.0, 30.0])
@pytest.mark.parametrize("shift", [0.0, 0.37])
def test_light_is_that_of_the_mask_wherever_it_lies_between_pixels(
    size: float, shift: float
) -> None:
    texture = mask_of(drop())
    row = ember(2.0, size, stretch=2.0, rotation=0.6, x=50 + shift, y=50 - shift)
    whole = 2.0 * size * size * 2.0 * texture.light.mean()
    assert drawn(row, texture)[..., 0].sum() == pytest.approx(whole, rel=0.05)


def test_light_beyond_the_frame_is_cut_off() -> None:
    texture = mask_of(drop())
    whole = drawn(ember(1.0, 20.0, x=50.0, y=50.0), texture)
    cut = drawn(ember(1.0, 20.0, x=0.0, y=50.0), texture)
    assert np.allclose(cut[:, :50], whole[:, 50:], atol=1e-6)
    assert not drawn(ember(1.0, 20.0, x=-50.0, y=500.0), texture).any()


@pytest.mark.parametrize("opacity", [1.0, 0.3])
def test_a_painted_texture_shows_its_own_colours_and_fades(opacity: float) -> None:
    texture = painted_with(*COLOURS)
    white = {"r": 1.0, "g": 1.0, "b": 1.0}
    for cell, wanted in enumerate(texture.light[:, 0, 0]):
        light = drawn(ember(opacity, 30.0, **white), texture, cell)
        assert np.allclose(
            expose(light)[50, 50], np.minimum(wanted * opacity, 254 / 255), atol=1e-3
        )


def test_a_mask_has_the_flakes_colour_whatever_was_painted() -> None:
    light = drawn(ember(3.0, 30.0, r=0.1, g=0.5, b=1.0), mask_of(drop()))
    assert np.allclose(light, light[..., 2:] * [0.1, 0.5, 1.0], atol=1e-5)
    assert light.max() == pytest.approx(3.0, abs=1e-3)


def test_no_flakes_give_no_light() -> None:
    none = draw_textured(np.zeros((0, len(COLUMNS))), FIRST[:0], mask_of(drop()), 5, 7)
    assert not none.rgb().any() and none.rgb().shape == (5, 7, 3)


def test_each_flake_keeps_its_cell_or_shows_all_in_turn() -> None:
    light = np.ones((4, 2, 2, 1), np.float32)
    ages = np.linspace(0, 0.99, 400)
    rows = np.array([ember(1.0, 5.0, id=float(i), age=float(age)) for i, age in enumerate(ages)])
    in_turn = TextureCells(light, over_life=True).cells_of(rows, 7)
    assert np.array_equal(in_turn, np.floor(ages * 4))
    lots = TextureCells(light, over_life=False)
    older = rows.copy()
    older[:, COLUMNS.index("age")] = 0.99
    assert np.array_equal(lots.cells_of(rows, 7), lots.cells_of(older[::-1], 7)[::-1])
    counts = np.bincount(lots.cells_of(rows, 7), minlength=4)
    assert counts.min() > 70 and not np.array_equal(lots.cells_of(rows, 7), lots.cells_of(rows, 8))


def test_cells_stay_with_their_flakes_in_loops_and_transitions() -> None:
    kind = COLUMNS.index("kind")
    rng = np.random.default_rng(3)
    frames = [
        np.array([ember(1.0, 5.0, id=float(i), kind=float(i % 5)) for i in range(n, n + 9)])
        for n in range(14)
    ]
    spawns = rng.uniform(1, 9, (23, len(SPAWN_COLUMNS)))
    spawns[:, 0] = np.arange(23)
    cells = tuple(rows[:, kind].astype(np.int64) for rows in frames)
    texture = TrackTexture(tuple("abcde"), tinted=True, cells=cells)
    once = Tracks.one_shot(24, (50, 50), 0, spawns, frames, texture=texture)
    loop = fold_into_loop(once, 10)
    shown = np.arange(4)
    faded = cross_faded(loop, loop, shown, shown + 5, np.linspace(0, 1, 4))
    for tracks in (loop, first_frames(loop, 3), faded):
        assert tracks.texture is not None and len(tracks.texture.cells) == len(tracks.frames)
        for rows, named in zip(tracks.frames, tracks.texture.cells, strict=True):
            assert np.array_equal(rows[:, kind], named) and len(rows)
