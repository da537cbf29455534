"""A picture as its file holds it says the same as in light."""

import numpy as np
import pytest

from fire_atlas.core.picture import as_bytes, brightness_of, to_light
from fire_atlas.core.pixels import brightness


@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_bytes_are_as_bright_as_their_light(space: str) -> None:
    picture = np.zeros((70, 90, 4), np.uint8)
    picture[8:61, 5:80] = np.random.default_rng(1).integers(0, 256, (53, 75, 4))
    picture[20:30, 20:40, 3] = 0  # hidden, whatever its colour
    wanted = brightness(to_light(picture), space)
    assert wanted.max() > 200
    # A step of the 16-bit table, where it is steepest.
    assert np.abs(brightness_of(picture, space) - wanted).max() <= 255 * 12.92 / 65535


def test_nothing_is_dark() -> None:
    nothing = np.zeros((4, 5, 4), np.uint8)
    nothing[..., :3] = 200
    assert not brightness_of(nothing, "srgb").any()


def test_bytes_survive_the_way_to_light_and_back() -> None:
    picture = np.zeros((2, 128, 4), np.uint8)
    picture[..., :3] = np.arange(256).reshape(2, 128, 1)
    picture[..., 3] = 255 - np.arange(128)
    assert as_bytes(picture) is picture
    back = as_bytes(to_light(picture))
    assert back.dtype == np.uint8 and np.abs(back.astype(int) - picture).max() <= 1
    assert np.array_equal(back[..., 3], picture[..., 3])
