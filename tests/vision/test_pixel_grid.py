"""The grid of enlarged pixel art is found wherever it begins, and nowhere else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.core.clip import Window
from fire_atlas.vision.pixel_grid import NOT_ENLARGED, PixelGrid, find_pixel_grid
from tests.support.clips import clip_of, open_clip


@settings(max_examples=30, deadline=None)
@given(
    side=st.integers(1, 9), left=st.integers(0, 8), top=st.integers(0, 8), seed=st.integers(0, 99)
)
def test_the_grid_is_found_wherever_a_crop_begins(
    side: int, left: int, top: int, seed: int
) -> None:
    art = np.random.default_rng(seed).integers(0, 2, (20, 16, 1)).repeat(4, axis=2)
    frame = np.kron(art, np.ones((side, side, 1))).astype(np.float32)
    grid = find_pixel_grid(clip_of([frame[top:, left:]]))
    assert grid == PixelGrid(side, -left % side, -top % side)
    whole = find_pixel_grid(clip_of([frame]))
    assert whole.cropped(Window(left, top, frame.shape[1], frame.shape[0])) == grid


@pytest.mark.parametrize("name", ["campfire", "candle", "cartoon", "pixel_art"])
def test_what_is_not_enlarged_has_no_grid(name: str) -> None:
    assert find_pixel_grid(open_clip(name)).side == 1


def test_a_few_rectangles_are_no_pixel_art() -> None:
    frame = np.zeros((60, 80, 4), np.float32)
    frame[10:30, 20:60] = 1
    assert find_pixel_grid(clip_of([frame])) == NOT_ENLARGED
