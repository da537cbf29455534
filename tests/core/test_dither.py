"""Dither: soft light in 8 bits without rings."""

import cv2
import numpy as np

from fire_atlas.core.dither import dithered
from fire_atlas.core.pixels import as_plane, decode_unit, encode_bytes


def glow() -> np.ndarray:
    """A wide glow of 10 steps of 8 bits, sRGB 0..255, (H, W, 3)."""
    row, column = np.mgrid[:200, :200]
    fall = 10 * np.exp(-(((row - 100) ** 2 + (column - 100) ** 2) / 60**2))
    return np.stack([fall, 0.5 * fall, 0.1 * fall], axis=2)


def off(shown: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """How far means of 9 x 9 px are from those that are wanted, of 255."""
    return np.asarray(cv2.blur(shown, (9, 9)) - cv2.blur(wanted, (9, 9)))


def test_neighbours_average_to_light_between_two_steps() -> None:
    wanted = glow()
    light = decode_unit(as_plane(wanted / 255))
    lit = wanted > 1
    plain, smooth = (
        np.abs(off(encode_bytes(each).astype(np.float64), wanted))[lit]
        for each in (light, dithered(light))
    )
    assert plain.max() > 0.3, "rings"
    assert smooth.max() < 0.15


def test_no_value_changes_by_more_than_a_step_and_black_stays_black() -> None:
    light = decode_unit(as_plane(glow() / 255))
    plain, smooth = (encode_bytes(each).astype(int) for each in (light, dithered(light)))
    assert np.abs(smooth - plain).max() <= 1
    assert not smooth[plain == 0].any()
