"""Resizing happens in premultiplied light."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.pixels import unpremultiply
from fire_atlas.sources.resize import resize, width_for
from tests.support import synthetic_fire as fire


def test_halving_averages_light_and_coverage() -> None:
    pixels = np.random.default_rng(1).random((8, 12, 4)).astype(np.float32)
    wanted = pixels.reshape(4, 2, 6, 2, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(resize(pixels, 6, 4), wanted, atol=1e-6)


@pytest.mark.parametrize("height", [13, 20, 40, 57, 120])
def test_the_height_asked_for_is_the_height_given(height: int, tmp_path: Path) -> None:
    folder = fire.write_folder(tmp_path / "f", fire.fires(2))
    clip = fire.open_clip(folder, height=height)
    assert (clip.width, clip.height) == (width_for(height, (48, 40)), height)
    assert clip.read(0).shape == (clip.height, clip.width, 4)


@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 9))
def test_pixels_stay_what_premultiplied_light_can_be(width: int, height: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    alpha = np.rint(rng.random((9, 11))).astype(np.float32)
    pixels = np.dstack([rng.random((9, 11, 3)).astype(np.float32) * alpha[..., None], alpha])
    got = resize(pixels, width, height)
    assert got.min() >= 0
    assert got[..., 3].max() <= 1
    assert (got[..., :3] <= got[..., 3:] + 1e-6).all()


def test_growing_keeps_hdr_light() -> None:
    pixels = np.full((8, 8, 4), (6, 3, 1, 0.5), np.float32)
    np.testing.assert_allclose(resize(pixels, 20, 20)[5, 5], (6, 3, 1, 0.5), rtol=1e-5)


def test_edges_do_not_fringe(tmp_path: Path) -> None:
    frame = np.zeros((40, 48, 4), np.uint8)
    frame[..., 1] = 255
    frame[10:30, 10:30] = (255, 60, 0, 255)
    folder = fire.write_folder(tmp_path / "f", [frame])
    for height in (27, 60):
        pixels = fire.open_clip(folder, height=height).read(0)
        colour = unpremultiply(pixels)[pixels[..., 3] > 0.01]
        np.testing.assert_allclose(colour, np.broadcast_to(colour[0], colour.shape), atol=0.02)
