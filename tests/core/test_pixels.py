"""Encodings of light against the published curve."""

import numpy as np
import pytest

from fire_atlas.core.pixels import (
    brightness,
    decode_bytes,
    decode_unit,
    encode_bytes,
    encode_unit,
    hex_to_linear,
    hex_to_srgb,
    linear_to_srgb,
    magnitude,
    premultiply,
    srgb_to_hex,
    srgb_to_linear,
    unpremultiply,
)


@pytest.mark.parametrize(
    ("srgb", "linear"), [(0.0, 0.0), (0.04045, 0.0031308), (0.5, 0.2140411), (1.0, 1.0)]
)
def test_the_srgb_curve_has_its_published_values(srgb: float, linear: float) -> None:
    assert srgb_to_linear(np.array([srgb]))[0] == pytest.approx(linear, abs=1e-6)
    assert linear_to_srgb(np.array([linear]))[0] == pytest.approx(srgb, abs=1e-5)


def test_every_byte_survives_the_way_to_light_and_back() -> None:
    every = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert np.array_equal(encode_bytes(decode_bytes(every)), every)


@pytest.mark.parametrize("light", [1.0, 2.0, 40000.0, 1e30, np.inf])
def test_light_beyond_white_is_white(light: float) -> None:
    plane = np.full((2, 3), light, np.float32)
    assert (encode_bytes(plane) == 255).all()
    assert (encode_unit(plane) == 1.0).all()


def test_negative_light_is_black() -> None:
    assert not encode_bytes(np.full((2, 3), -0.5, np.float32)).any()


def test_premultiplied_pixels_give_their_colour_back() -> None:
    chance = np.random.default_rng(0)
    colour = chance.random((5, 6, 3), np.float32)
    alpha = chance.random((5, 6), np.float32) + np.float32(0.01)
    assert np.allclose(unpremultiply(premultiply(colour, alpha)), colour, atol=1e-6)


@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_grey_has_the_brightness_of_its_byte(space: str) -> None:
    grey = np.full((2, 2, 3), 137, np.uint8)
    pixels = premultiply(decode_bytes(grey), np.ones((2, 2), np.float32))
    assert brightness(pixels, space) == pytest.approx(137, abs=0.1)


@pytest.mark.parametrize(("space", "shown"), [("srgb", 127.5), ("linear", 187.5)])
def test_half_covered_white_is_as_bright_as_the_client_shows_it(space: str, shown: float) -> None:
    pixels = np.full((2, 2, 4), 0.5, np.float32)
    assert brightness(pixels, space) == pytest.approx(shown, abs=0.1)


def test_a_picture_without_pixels_is_encoded_to_one_without_bytes() -> None:
    none = np.empty((1, 0, 3), np.float32)
    assert encode_bytes(none).shape == decode_unit(none).shape == (1, 0, 3)
    assert encode_bytes(none).dtype == np.uint8


def test_a_magnitude_is_the_length_of_its_vector() -> None:
    x, y = np.array([[3.0, -5.0, 0.0]], np.float32), np.array([[4.0, 12.0, 0.0]], np.float32)
    assert magnitude(x, y).tolist() == [[5.0, 13.0, 0.0]]


def test_a_magnitude_has_the_same_bits_wherever_in_memory_it_lies() -> None:
    rng = np.random.default_rng(1)
    x, y = (rng.normal(size=(37, 29)).astype(np.float32) for _ in range(2))
    found = [magnitude(x, y) for _ in range(64)]  # all kept, so that each lies elsewhere
    assert len({plane.tobytes() for plane in found}) == 1


def test_hex_colours_are_read_as_they_are_written() -> None:
    shown = hex_to_srgb(["#ff7300", "#000102"])
    assert shown.tolist() == [[255, 115, 0], [0, 1, 2]]
    assert [srgb_to_hex(color) for color in shown] == ["#ff7300", "#000102"]
    assert hex_to_linear(["#ffffff"]).tolist() == [[1, 1, 1]]
