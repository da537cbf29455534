"""Blend modes in linear light, exposure, blur."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.core.pixels import (
    as_plane,
    encode_bytes,
    expose,
    linear_to_srgb,
    srgb_to_linear,
)
from fire_atlas.effect.composition.blur import blur_along
from fire_atlas.effect.composition.composite import VISIBLE_LIGHT, compose
from fire_atlas.effect.flakes.layer import FlakeLight


def _flame(light: float, alpha: float) -> NDArray[np.float32]:
    return np.tile(np.array([[light], [light], [light], [alpha]], np.float32), (1, 20))


def _flakes(*rgb: float) -> NDArray[np.float32]:
    """Light that film shows as ``rgb``."""
    shown = np.array(rgb, np.float32)[:, None]
    return np.tile(shown / (1 - shown), (1, 20))


def _film(light: NDArray[np.float64]) -> NDArray[np.float64]:
    return light / (1 + light)


def test_film_shows_each_channel_by_its_own_shoulder() -> None:
    light = np.array([[4.0, 0.5, 0.1]], np.float32)
    assert np.allclose(expose(light), [[4 / 5, 1 / 3, 1 / 11]])


@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_add_shows_the_sum_of_the_light_that_film_saw(space: str) -> None:
    flame = np.array([[0.3], [0.2], [0.0], [1.0]], np.float32)
    flakes = np.array([[2.0], [0.4], [0.05]], np.float32)
    out = compose(flame, flakes, "add", space)
    wanted = _film(np.array([0.3 / 0.7 + 2, 0.2 / 0.8 + 0.4, 0.05]))
    assert out[:3, 0] == pytest.approx(wanted, rel=1e-4)
    assert out[3, 0] == 1


def test_add_on_a_thin_flame_shows_over_black_what_it_shows_on_an_opaque_one() -> None:
    """A client that blends in sRGB shows sRGB(c) · coverage."""
    flame = np.array([[0.05], [0.03], [0.01], [0.4]], np.float32)
    flakes = np.array([[0.3], [0.05], [0.01]], np.float32)
    out = compose(flame, flakes, "add", "srgb")
    page = encode_frame(out.T[None].copy(), "premultiplied", "srgb")[0, 0, :3] / 255
    behind = encode_frame(flame.T[None].copy(), "premultiplied", "srgb")[0, 0, :3] / 255
    seen = srgb_to_linear(behind).astype(np.float64)
    wanted = linear_to_srgb(_film(seen / (1 - seen) + flakes[:, 0]))
    assert page == pytest.approx(wanted, abs=1.5 / 255)
    assert out[3, 0] >= 0.4


@pytest.mark.parametrize("blend", ["add", "screen"])
def test_no_light_makes_a_flame_darker(blend: str) -> None:
    flame = np.vstack([np.tile(np.linspace(0, 1, 256, dtype=np.float32), (3, 1)), np.ones(256)])
    for light in (1e-4, 0.05, 3.0, 500.0):
        out = compose(flame.astype(np.float32), np.full((3, 256), light, np.float32), blend, "srgb")
        assert (out[:3] >= flame[:3] - 1e-6).all() and (out <= 1).all()
        assert (np.diff(out[0]) >= -1e-6).all()


def test_screen_is_of_the_exposed_light() -> None:
    out = compose(_flame(0.8, 1.0), _flakes(0.9, 0.5, 0.0), "screen", "linear")
    assert np.allclose(out[:3, 0], [0.98, 0.9, 0.8])


def test_over_hides_what_is_behind_a_bright_flake() -> None:
    out = compose(_flame(0.8, 1.0), _flakes(0.999, 0.4, 0.0), "over", "linear")
    assert np.allclose(out[:, 0], [1.0, 0.4, 0.0, 1.0], atol=2e-3)


@pytest.mark.parametrize("light", [0.003, 0.05, 0.2, 0.9])
@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_over_hides_no_more_than_it_shines(light: float, space: str) -> None:
    """The soft rim of a sprite is no dark ring on the flame."""
    out = compose(_flame(1.0, 1.0), _flakes(light, 0.4 * light, 0.0), "over", space)
    assert out[0, 0] == pytest.approx(1.0, abs=1e-4)
    assert (out[:3, 0] >= 1 - light - 1e-4).all()


@pytest.mark.parametrize("blend", ["add", "screen", "over"])
@pytest.mark.parametrize("light", [0.002, 0.02, 0.07, 0.3, 0.99])
def test_a_flake_beside_the_flame_is_as_bright_as_its_light(blend: str, light: float) -> None:
    """Over black it looks like its light, and over white it only takes what its hue lacks."""
    rgb = light, 0.3 * light, 0.02 * light
    out = compose(_flame(0.0, 0.0), _flakes(*rgb), blend, "srgb")
    page = encode_frame(out.T[None].copy(), "premultiplied", "srgb")[0, 0].astype(int)
    wanted = encode_bytes(np.array([[rgb]], np.float32))[0, 0].astype(int)
    assert np.abs(page[:3] - wanted).max() <= 1
    over_white = page[:3] + 255 - page[3]
    assert over_white[0] >= 254


@pytest.mark.parametrize("blend", ["add", "screen", "over"])
@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_coverage_always_carries_the_light_up_to_one(blend: str, space: str) -> None:
    chance = np.random.default_rng(0)
    flame = _flame(0.0, 0.0)
    flame[3] = chance.random(20)
    flame[:3] = flame[3:] * chance.random((3, 20))
    out = compose(flame, chance.random((3, 20), np.float32) * 3, blend, space)
    assert (out[3] >= np.minimum(out[:3].max(axis=0), 1) - 1e-6).all()
    assert (out[3] <= 1 + 1e-6).all()


def test_blur_keeps_the_energy_within_a_percent() -> None:
    chance = np.random.default_rng(1)
    pixels = np.zeros((64, 80, 4), np.float32)
    pixels[20:44, 25:55] = chance.random((24, 30, 1), np.float32)
    y, x = np.mgrid[:16, :20].astype(np.float32)
    u, v = (30 * np.sin(x / 5)).astype(np.float32), (-200 + 60 * np.cos(y / 4)).astype(np.float32)
    kappa = np.ones((64, 80), np.float32)
    blurred = blur_along(pixels, u, v, 4, kappa, exposure=1 / 48, samples=9)
    assert blurred.sum() == pytest.approx(pixels.sum(), rel=0.01)
    assert np.abs(blurred - pixels).max() > 0.05


def test_a_uniform_blur_is_a_box_along_the_motion() -> None:
    pixels = np.zeros((61, 61, 4), np.float32)
    pixels[10, 30] = 1.0
    still, fast = np.zeros((16, 16), np.float32), np.full((16, 16), 240.0, np.float32)
    kappa = np.ones((61, 61), np.float32)
    row = blur_along(pixels, fast, still, 4, kappa, exposure=1 / 24, samples=41)[10, :, 0]
    assert row[26:35] == pytest.approx(0.1, abs=0.01)  # 10 px of travel share the light
    assert row[:24].max() == 0 and row[37:].max() == 0


def test_blur_carries_what_leaves_a_tile_in_at_the_other_side() -> None:
    chance = np.random.default_rng(4)
    pixels = chance.random((32, 64, 4), np.float32)
    u, v = chance.normal(0, 300, (2, 8, 16)).astype(np.float32)
    kappa = np.ones((32, 64), np.float32)

    def blurred(columns: int) -> NDArray[np.float32]:
        right, down = (np.roll(plane, columns // 4, axis=1) for plane in (u, v))
        moved = np.roll(pixels, columns, axis=1)
        return blur_along(moved, right, down, 4, kappa, 1 / 24, 9, tiles=True)

    assert np.abs(blurred(0) - pixels).max() > 0.2
    assert np.abs(np.roll(blurred(0), 20, axis=1) - blurred(20)).max() < 1e-3


def test_kappa_zero_does_not_blur() -> None:
    pixels = np.random.default_rng(2).random((16, 16, 4), np.float32)
    field = np.full((4, 4), 500.0, np.float32)
    kappa = np.zeros((16, 16), np.float32)
    assert np.allclose(blur_along(pixels, field, field, 4, kappa, 0.02, 9), pixels, atol=1e-6)


def test_blur_takes_the_field_where_flakes_do_though_the_grid_overhangs_the_frame() -> None:
    pixels = np.zeros((66, 66, 4), np.float32)
    pixels[33, 33] = 1.0
    still, fast_beyond = np.zeros((2, 2), np.float32), np.array([[0.0, 1000.0]] * 2, np.float32)
    here = pixels[..., 0].copy()
    blurred = blur_along(pixels, fast_beyond, still, 64, here, exposure=0.1, samples=201)
    # Cells' centres are at 32 and 96 px: at 33.5 px the field moves at 23.4 px/s, or 1.17 px to
    # either side, of which the inner px is seen; and 5 % of light is put back.
    assert blurred[33, 33, 0] == pytest.approx(1.05 / 2.34, abs=0.02)


def test_dots_are_discs_with_smooth_edges() -> None:
    """Light that falls as a Gaussian ends where it is shown as a quarter of white."""
    y, x = np.mgrid[:41, :41]
    shown = float(srgb_to_linear(np.array(0.25)))
    edge = shown / (1 - shown)
    assert pytest.approx(edge) == VISIBLE_LIGHT
    for radius in (1.8, 3.0, 7.5):
        distance = np.hypot(x - 20.3, y - 19.6)
        light = edge * np.exp((radius**2 - distance**2) / 12)
        layer = FlakeLight(as_plane(light)[None], np.array([[1, 0.4, 0.1]], np.float32))
        cover = layer.dots(VISIBLE_LIGHT)
        assert cover.sum() == pytest.approx(np.pi * radius**2, rel=0.06)
        assert (cover[distance < radius - 1] == 1).all()
        assert (cover[distance > radius + 1] == 0).all()
        between = (cover > 0.02) & (cover < 0.98)
        assert between.sum() > np.pi * radius, "steps of whole pixels would be seen"


def test_a_dot_has_one_colour_of_the_palette_from_middle_to_edge() -> None:
    palette = np.array([[0.9, 0.2, 0.1], [1.0, 0.7, 0.1], [0.2, 0.1, 0.1]], np.float32)
    falling = np.geomspace(3, 0.05, 12, dtype=np.float32)
    flakes = as_plane(np.outer([1.0, 0.45, 0.01], falling))
    dots = np.linspace(1, 0, 12, dtype=np.float32)
    flame = _flame(0.2, 1.0)[:, :1].repeat(12, axis=1)
    out = compose(flame, flakes, "add", "srgb", palette, dots)
    painted = srgb_to_linear(palette[1])[:, None]
    assert np.allclose(out[:3], flame[:3] + (painted - flame[:3]) * dots, atol=1e-6)
    assert np.allclose(out[3], flame[3] + (1 - flame[3]) * dots)
