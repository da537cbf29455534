"""A page shows the same picture in its client, whatever way it is stored."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from fire_atlas.atlas.encode import (
    Alpha,
    BlendSpace,
    encode_frame,
    encode_sprite,
    encode_sprites,
)
from fire_atlas.core.picture import to_light
from fire_atlas.core.pixels import (
    Bytes,
    Pixels,
    decode_bytes,
    linear_to_srgb,
    premultiply,
    srgb_to_linear,
)
from fire_atlas.recipe.output import Atlas

ALPHAS: tuple[Alpha, ...] = ("straight", "premultiplied", "additive")
SPACES: tuple[BlendSpace, ...] = ("srgb", "linear")
LARGEST_ERROR = {"straight": 2 / 255, "premultiplied": 1 / 255, "additive": 1 / 255}
BLACK, GREY, WHITE = 0.0, 0.5, 1.0

Floats = NDArray[np.float32]

pixel_values = arrays(np.float32, (7, 5, 4), elements=st.floats(0, 1, width=32))


def blended_by_client(image: Bytes, background: float, alpha: Alpha, space: BlendSpace) -> Floats:
    """What a client shows of a page over a grey, in the space where it blends."""
    shown = decode_bytes(image) if space == "linear" else image / np.float32(255)
    behind = srgb_to_linear(np.array(background)) if space == "linear" else np.float32(background)
    coverage = image[..., 3:] / np.float32(255)
    light = shown[..., :3] * coverage if alpha == "straight" else shown[..., :3]
    return np.minimum(light + behind * (1 - coverage), 1)


def blended_exactly(pixels: Pixels, background: float, alpha: Alpha, space: BlendSpace) -> Floats:
    """The same picture without 8-bit files. Light beyond the coverage is cut at white."""
    coverage = pixels[..., 3:]
    light = np.minimum(pixels[..., :3], coverage)
    colour = np.divide(light, coverage, out=np.zeros_like(light), where=coverage > 0)
    shown = colour if space == "linear" else linear_to_srgb(colour)
    behind = srgb_to_linear(np.array(background)) if space == "linear" else np.float32(background)
    hidden = 0 if alpha == "additive" else coverage
    return np.minimum(shown * coverage + behind * (1 - hidden), 1)


def error_of(shown: Floats, exact: Floats, space: BlendSpace) -> float:
    """The largest error of any pixel, where a client blends linear light as light or on screen.

    Half a byte of sRGB is up to 1.14/255 of linear light, and half a byte of coverage up to
    6.5/255 of sRGB: by either scale alone no 8-bit page could keep to 1/255.
    """
    error = np.abs(shown - exact)
    if space == "linear":
        error = np.minimum(error, np.abs(linear_to_srgb(shown) - linear_to_srgb(exact)))
    return float(error.max())


@pytest.mark.parametrize("background", [BLACK, GREY, WHITE])
@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("alpha", ALPHAS)
@given(colour_and_coverage=pixel_values)
def test_a_client_shows_the_picture_that_was_composed(
    alpha: Alpha, space: BlendSpace, background: float, colour_and_coverage: Floats
) -> None:
    pixels = premultiply(colour_and_coverage[..., :3], colour_and_coverage[..., 3])
    page = encode_frame(pixels, alpha, space)
    shown = blended_by_client(page, background, alpha, space)
    exact = blended_exactly(pixels, background, alpha, space)
    assert error_of(shown, exact, space) <= LARGEST_ERROR[alpha] + 1e-5


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("alpha", ALPHAS)
@given(pixels=pixel_values)
def test_light_without_enough_coverage_is_cut_at_white(
    alpha: Alpha, space: BlendSpace, pixels: Pixels
) -> None:
    bright = pixels * np.array([4, 4, 4, 1], np.float32)
    shown = blended_by_client(encode_frame(bright, alpha, space), BLACK, alpha, space)
    exact = blended_exactly(bright, BLACK, alpha, space)
    assert error_of(shown, exact, space) <= LARGEST_ERROR[alpha] + 1e-5


@pytest.mark.parametrize("space", SPACES)
def test_every_straight_colour_survives_untouched(space: BlendSpace) -> None:
    image = np.empty((256, 256, 4), np.uint8)
    image[..., :3] = np.arange(256)[None, :, None]
    image[..., 3] = np.arange(256)[:, None]
    coverage = (image[..., 3] / 255).astype(np.float32)
    pixels = premultiply(decode_bytes(image)[..., :3], coverage)
    expected = np.where(image[..., 3:] > 0, image, 0)
    np.testing.assert_array_equal(encode_frame(pixels, "straight", space), expected)


def test_dim_light_stays_smooth_on_screen_in_a_linear_client() -> None:
    coverage = np.linspace(0, 0.05, 500, dtype=np.float32)[None]
    pixels = premultiply(np.ones((1, 500, 3), np.float32), coverage)
    page = encode_frame(pixels, "straight", "linear")
    shown = linear_to_srgb(blended_by_client(page, BLACK, "straight", "linear")[..., 0])
    assert np.abs(shown - linear_to_srgb(coverage)).max() <= 2 / 255


def test_additive_pages_have_no_alpha_and_premultiplied_ones_no_light_beyond_theirs() -> None:
    pixels = np.random.default_rng(3).random((9, 9, 4), np.float32)
    assert not encode_frame(pixels, "additive", "srgb")[..., 3].any()
    page = encode_frame(pixels, "premultiplied", "srgb")
    assert (page[..., :3] <= page[..., 3:]).all()


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("alpha", ALPHAS)
def test_a_sprite_is_the_lit_part_of_the_encoded_frame(alpha: Alpha, space: BlendSpace) -> None:
    pixels = np.zeros((200, 150, 4), np.float32)
    pixels[70:171, 31:90] = np.random.default_rng(5).random((101, 59, 4), np.float32)
    sprite = encode_sprite(pixels, alpha, space)
    height, width = sprite.image.shape[:2]
    frame = np.zeros((200, 150, 4), np.uint8)
    frame[sprite.y : sprite.y + height, sprite.x : sprite.x + width] = sprite.image
    assert (height, width) == (101, 59)
    np.testing.assert_array_equal(frame, encode_frame(pixels, alpha, space))


def test_a_frame_without_fire_is_one_clear_pixel() -> None:
    sprite = encode_sprite(np.zeros((40, 30, 4), np.float32), "straight", "srgb")
    assert (sprite.image.shape, sprite.x, sprite.y) == ((1, 1, 4), 0, 0)
    assert not sprite.image.any()


@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_a_picture_in_straight_bytes_is_the_one_that_goes_by_way_of_light(
    space: BlendSpace,
) -> None:
    """Every colour under every coverage, and borders of all kinds of nothing."""
    value, alpha = np.meshgrid(np.arange(256), np.arange(256))
    whole = np.zeros((280, 300, 4), np.uint8)
    whole[10:266, 20:276] = np.stack([value, value[::-1], alpha.T, alpha], axis=2)
    for picture in (whole, whole[:, :20], whole[10:266, 20:276], whole[11:12]):
        settings = Atlas(alpha="straight", blend_space=space)
        (sprite,) = encode_sprites(picture, settings)
        wanted = encode_sprite(to_light(picture), "straight", settings.blend_space)
        assert np.array_equal(sprite.image, wanted.image)
        assert replace(sprite, image=wanted.image) == wanted


def test_a_picture_in_bytes_goes_by_way_of_light_where_pages_differ_from_it() -> None:
    picture = np.random.default_rng(4).integers(0, 256, (24, 24, 4)).astype(np.uint8)
    for settings in (Atlas(alpha="premultiplied"), Atlas(scales=(1.0, 0.5))):
        for got, wanted in zip(
            encode_sprites(picture, settings), encode_sprites(to_light(picture), settings),
            strict=True,
        ):  # fmt: skip
            assert np.array_equal(got.image, wanted.image)
