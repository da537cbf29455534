"""Nothing overlaps, nothing is lost, and pages are few and full."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.atlas.pack import Layout, Packing, Size, pack
from fire_atlas.core.errors import OutputError

MAX_SIZE = 64

sizes_of_sprites = st.lists(
    st.tuples(st.integers(1, MAX_SIZE), st.integers(1, MAX_SIZE)), min_size=1, max_size=40
)


def assert_sound(packing: Packing, sizes: list[Size], max_size: int, padding: int) -> None:
    """Each rectangle lies inside a page, and ``padding`` px from every other."""
    assert len(packing.places) == len(sizes)
    assert {place.page for place in packing.places} == set(range(len(packing.pages)))
    assert max(max(page) for page in packing.pages) <= max_size
    placed = list(zip(packing.places, sizes, strict=True))
    for place, (width, height) in placed:
        page_width, page_height = packing.pages[place.page]
        assert 0 <= place.x <= page_width - width
        assert 0 <= place.y <= page_height - height
    for (a, (a_width, a_height)), (b, (b_width, b_height)) in combinations(placed, 2):
        beside = a.x + a_width + padding <= b.x or b.x + b_width + padding <= a.x
        above = a.y + a_height + padding <= b.y or b.y + b_height + padding <= a.y
        assert a.page != b.page or beside or above


@pytest.mark.parametrize("layout", ["packed", "grid"])
@given(sizes=sizes_of_sprites, padding=st.integers(0, 5))
def test_every_rectangle_has_its_own_place(layout: Layout, sizes: list[Size], padding: int) -> None:
    assert_sound(pack(sizes, MAX_SIZE, padding, layout), sizes, MAX_SIZE, padding)


@given(sizes=sizes_of_sprites)
def test_packing_again_gives_the_same(sizes: list[Size]) -> None:
    assert pack(sizes, MAX_SIZE, 2, "packed") == pack(list(sizes), MAX_SIZE, 2, "packed")


def test_padding_is_only_between_neighbours() -> None:
    assert pack([(10, 20)], 20, 8, "packed").pages == ((10, 20),)
    assert pack([(10, 20)], 20, 8, "grid").pages == ((10, 20),)


@pytest.mark.parametrize("layout", ["packed", "grid"])
def test_equal_sprites_fill_a_page_without_waste(layout: Layout) -> None:
    packing = pack([(30, 50)] * 48, 4096, 0, layout)
    assert [width * height for width, height in packing.pages] == [48 * 30 * 50]


def test_a_grid_plays_row_by_row_in_cells_of_one_size() -> None:
    packing = pack([(10, 10), (4, 4), (10, 6), (1, 1)], 64, 2, "grid")
    assert packing.pages == ((22, 22),)
    assert [(place.x, place.y) for place in packing.places] == [(0, 0), (12, 0), (0, 12), (12, 12)]


def test_varied_sprites_leave_little_empty() -> None:
    drawn = np.random.default_rng(1).lognormal(4.2, 0.55, (300, 2)).astype(int) + 1
    sizes = [(int(width), int(height)) for width, height in drawn]
    packing = pack(sizes, 2048, 0, "packed")
    assert_sound(packing, sizes, 2048, 0)
    used = sum(width * height for width, height in sizes)
    assert used >= 0.92 * sum(width * height for width, height in packing.pages)


def test_frames_that_need_several_pages_stay_in_playing_order() -> None:
    packing = pack([(20, 30), (18, 31), (19, 29)] * 6, 64, 2, "packed")
    pages = [place.page for place in packing.places]
    assert len(packing.pages) > 1
    assert pages == sorted(pages)


def test_order_gives_way_to_fewer_pages() -> None:
    halves_and_wholes = [(64, 32), (64, 64), (64, 32), (64, 64)]
    assert len(pack(halves_and_wholes, 64, 0, "packed").pages) == 3


@pytest.mark.parametrize("layout", ["packed", "grid"])
def test_a_frame_larger_than_a_page_is_refused_with_advice(layout: Layout) -> None:
    with pytest.raises(OutputError, match=r"frame 1 is 70 × 8 px.*atlas\.max_size.*source\.height"):
        pack([(8, 8), (70, 8)], 64, 0, layout)
