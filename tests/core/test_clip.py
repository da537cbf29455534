"""Frames that are expensive to compute are computed once, while there is room for them."""

from collections import Counter

import numpy as np
import pytest
from numpy.typing import NDArray

from fire_atlas.core import clip
from fire_atlas.core.clip import cached

SIZE = (40, 30, 4)
BYTES = 40 * 30 * 4 * 4


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> Counter[int]:
    """How often each was computed; there is room for two, and for some that are compressed."""
    monkeypatch.setattr(clip, "CACHE_BYTES", BYTES + 100)
    monkeypatch.setattr(clip, "COMPRESSED_BYTES", 7 * BYTES // 4)
    return Counter()


def frame(i: int, computed: Counter[int]) -> NDArray[np.float32]:
    """Return noise in the upper half of a frame that is else empty."""
    computed[i] += 1
    made = np.zeros(SIZE, np.float32)
    made[:20] = np.random.default_rng(i).random((20, 30, 4), np.float32)
    return made


def test_frames_are_computed_once_while_there_is_room(computed: Counter[int]) -> None:
    read = cached(lambda i: frame(i, computed), range(8))
    first = [read(i) for i in range(8)]
    again = [read(i) for i in range(8)]
    for one, other in zip(first, again, strict=True):
        assert other.dtype == np.float32 and np.array_equal(one, other)
    kept = [i for i in range(8) if computed[i] == 1]
    assert kept == [0, 1, 2, 3, 4]  # two as they are, three that take about half as much


@pytest.mark.parametrize("place", [(0, 0, 3), (39, 29, 0), (17, 0, 1), (0, 12, 2)])
def test_a_frame_is_whole_however_little_is_in_it(place: tuple[int, int, int]) -> None:
    dot = np.zeros(SIZE, np.float32)
    for light in (0.0, 1e-30):  # none; light that is dim, and perhaps without coverage
        dot[place] = light
        read = cached(lambda _: dot.copy(), range(1))
        assert np.array_equal(read(0), dot) and np.array_equal(read(0), dot)


def test_what_is_read_may_be_changed(computed: Counter[int]) -> None:
    read = cached(lambda i: frame(i, computed), range(8))
    for i in (1, 3):
        read(i)
        read(i)[:] = 0
        assert read(i).any()
    whole = cached(lambda _: np.ones(SIZE, np.float32), range(1))
    whole(0)[:] = 0
    assert whole(0).all()


def test_frames_that_are_cheap_are_not_kept(computed: Counter[int]) -> None:
    read = cached(lambda i: frame(i, computed), range(1))
    for i in (0, 5, 0, 5):
        read(i)
    assert computed == {0: 1, 5: 2}
