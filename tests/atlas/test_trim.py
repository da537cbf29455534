"""What is empty is cut, and what ``trim`` means."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fire_atlas.atlas.sheet import Rect
from fire_atlas.atlas.trim import lit_rect, trim_rects, trimmed
from fire_atlas.core.pixels import Bytes

sparse_images = arrays(
    np.uint8,
    st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(4)),
    elements=st.integers(0, 255),
    fill=st.just(0),
)


@given(sparse_images)
def test_trimming_keeps_every_lit_pixel_and_no_empty_border(image: Bytes) -> None:
    sprite = trimmed(image)
    height, width = sprite.image.shape[:2]
    restored = np.zeros_like(image)
    restored[sprite.y : sprite.y + height, sprite.x : sprite.x + width] = sprite.image
    np.testing.assert_array_equal(restored, image)
    if image.any():
        assert sprite.image[0].any()
        assert sprite.image[-1].any()
        assert sprite.image[:, 0].any()
        assert sprite.image[:, -1].any()


def test_light_without_alpha_counts() -> None:
    image = np.zeros((6, 8, 4), np.uint8)
    image[2, 3, 0] = 1
    assert lit_rect(image) == Rect(3, 2, 1, 1)


def test_an_animation_shares_one_box_that_empty_frames_do_not_widen() -> None:
    frames = np.zeros((3, 20, 30, 4), np.uint8)
    frames[0, 5:10, 8:12] = 9
    frames[1, 7:15, 10:20] = 9
    sprites = [trimmed(frame) for frame in frames]
    assert trim_rects(sprites, "animation") == [Rect(8, 5, 12, 10)] * 3
    assert trim_rects(sprites, "frame") == [Rect(8, 5, 4, 5), Rect(10, 7, 10, 8), Rect(0, 0, 1, 1)]
    assert trim_rects(sprites, "none") == [Rect(0, 0, 30, 20)] * 3


def test_an_animation_without_any_light_is_one_pixel() -> None:
    sprites = [trimmed(np.zeros((20, 30, 4), np.uint8))] * 2
    assert trim_rects(sprites, "animation") == [Rect(0, 0, 1, 1)] * 2
