"""A flame with less fuel: lower, eaten away from its tips and edges, cooler, and never a fade."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels, encode_unit
from fire_atlas.heat.less_fuel import FlameFuel
from fire_atlas.vision.pixel_grid import PixelGrid
from tests.support.clips import open_clip

FUELS = (0.9, 0.7, 0.5, 0.3, 0.15)

HEIGHT, WIDTH, FOOT = 120, 90, (45.0, 110.0)


def flame(across: float = 0.0) -> Pixels:
    """A tongue on its foot, orange at its edges and white in its core; it leans with ``across``."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    up = np.clip((FOOT[1] - y) / 90, 0, None)
    half = 20 * np.clip(1 - up, 0, 1) ** 0.7 * (y < FOOT[1])
    off = np.abs(x - FOOT[0] - across * up * 10)
    heat = np.clip(1 - off / np.maximum(half, 1e-3), 0, 1) ** 0.6
    light = np.stack([heat**1.2, 0.8 * heat**2.2, 0.6 * heat**5, heat], axis=-1)
    return np.asarray(light, np.float32)


def burning(*, is_drawn: bool = False) -> FlameFuel:
    return FlameFuel.of([flame()], FOOT, (0.0, -1.0), (90.0, 40.0), is_drawn=is_drawn)


def lit(frame: Pixels) -> NDArray[np.bool_]:
    return np.asarray(encode_unit(frame[..., :3].max(axis=-1)) > 0.1)


def height_of(frame: Pixels) -> int:
    rows = np.flatnonzero(lit(frame).any(axis=1))
    return int(rows[-1] + 1 - rows[0])


def test_all_of_its_fuel_changes_nothing_and_none_leaves_nothing() -> None:
    whole = flame()
    assert burning().burnt(whole, 1.0) is whole
    assert not burning().burnt(whole, 0.0).any()


def test_it_gets_lower_and_smaller_with_its_fuel_and_keeps_its_foot() -> None:
    frames = [flame(), *(burning().burnt(flame(), fuel) for fuel in FUELS)]
    heights, areas = [height_of(f) for f in frames], [int(lit(f).sum()) for f in frames]
    assert heights == sorted(heights, reverse=True)
    assert areas == sorted(areas, reverse=True)
    assert heights[3] < 0.65 * heights[0]
    for frame in frames:
        assert abs(np.flatnonzero(lit(frame).any(axis=1))[-1] - FOOT[1]) <= 3


@pytest.mark.parametrize("fuel", FUELS[:4])
def test_it_is_no_fade_what_is_hot_burns_on(fuel: float) -> None:
    left = burning().burnt(flame(), fuel)
    brightest = encode_unit(left[..., :3].max(axis=(0, 1)))
    assert brightest[0] > 0.85
    # A fade would keep the area and lose brightness everywhere alike.
    assert lit(left).sum() < (0.25 + 0.75 * fuel) * lit(flame()).sum()


def test_tips_go_before_the_foot() -> None:
    left = burning().burnt(flame(), 0.5)
    lower = flame()
    rows = np.flatnonzero(lit(left).any(axis=1))
    foot, tip = rows[-1] - 8, rows[0] + 4
    assert lit(left)[foot].sum() / lit(lower)[foot].sum() > 0.5
    assert lit(left)[tip].sum() < 0.5 * lit(left)[foot].sum()


@pytest.mark.parametrize("name", ["campfire", "candle", "torch"])
def test_what_cools_keeps_to_the_colours_of_its_clip(name: str) -> None:
    """Red, then orange, then yellow: no pixel is bluer or greener than fire of its brightness."""
    clip = open_clip(name, 120)
    frames = [clip.read(i) for i in range(0, clip.count, 4)]
    height, width = frames[0].shape[:2]
    fuel = FlameFuel.of(frames, (width / 2, height * 0.9), (0.0, -1.0), (height * 0.7, width / 3))
    for share in FUELS:
        left = fuel.burnt(frames[0], share)
        bright = left[..., 0] > 0.3
        red, green, blue = (left[..., k][bright] for k in range(3))
        assert (green <= 1.01 * red).all()
        assert (blue <= 1.01 * green).mean() > 0.98


def test_blue_fire_dies_blue() -> None:
    blue = np.ascontiguousarray(flame()[..., [2, 1, 0, 3]])
    left = FlameFuel.of([blue], FOOT, (0.0, -1.0), (90.0, 40.0)).burnt(blue, 0.4)
    bright = left[..., 2] > 0.2
    assert bright.any()
    assert (left[..., 0][bright] <= left[..., 2][bright]).all()


def test_drawn_fire_keeps_its_colours_and_gets_smaller() -> None:
    left = burning(is_drawn=True).burnt(flame(), 0.4)
    assert left[..., :3].max() == pytest.approx(flame()[..., :3].max(), abs=0.05)
    assert height_of(left) < 0.7 * height_of(flame())


@pytest.mark.parametrize("side", [1, 3])
def test_pixel_art_stays_whole_pixels_in_its_colours(side: int) -> None:
    chance = np.random.default_rng(5)
    small = chance.integers(0, 4, (40, 30, 4)) / 3.0
    small[:4] = 0
    art = np.asarray(np.kron(small, np.ones((side, side, 1))), np.float32)
    fuel = FlameFuel.of(
        [art], (15.0 * side, 40.0 * side), (0.0, -1.0), (36.0 * side, 30.0 * side),
        art=PixelGrid(side),
    )  # fmt: skip
    known = {tuple(row) for row in art.reshape(-1, 4).tolist()} | {(0.0, 0.0, 0.0, 0.0)}
    for share in FUELS:
        left = fuel.burnt(art, share)
        assert {tuple(row) for row in left.reshape(-1, 4).tolist()} <= known
        cells = left.reshape(40, side, 30, side, 4)
        assert (cells == cells[:, :1, :, :1]).all()
        assert 0 < (left[..., 3] > 0).sum() < (art[..., 3] > 0).sum()


def test_fire_that_flies_sideways_shrinks_towards_its_head() -> None:
    turned = np.ascontiguousarray(np.rot90(flame(), -1))  # its foot is left, it rises to the right
    foot = (HEIGHT - FOOT[1], FOOT[0])
    fuel = FlameFuel.of([turned], foot, (1.0, 0.0), (90.0, 40.0))
    left = lit(fuel.burnt(turned, 0.4))
    columns = np.flatnonzero(left.any(axis=0))
    assert abs(columns[0] - foot[0]) <= 3
    assert columns[-1] < foot[0] + 60
