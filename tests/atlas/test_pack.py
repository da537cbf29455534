"""Nothing overlaps, nothing is lost, and pages are few and full."""

import math
import random
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fire_atlas.atlas.pack import Packing, PagePlacement, pack
from fire_atlas.atlas.page_rules import PageRules, Size

MAX_SIZE = 64

sizes_of_sprites = st.lists(
    st.tuples(st.integers(1, 40), st.integers(1, 40)), min_size=1, max_size=30
)
rules_of_pages = st.builds(
    PageRules,
    max_size=st.just(MAX_SIZE),
    padding=st.integers(0, 5),
    border=st.integers(0, 6),
    multiple_of=st.sampled_from([1, 2, 4]),
    pot=st.booleans(),
    square=st.booleans(),
    rotate=st.booleans(),
)


def packed(sizes: list[Size], rules: PageRules) -> Packing:
    """Pack the frames of a single animation."""
    return pack(sizes, [range(len(sizes))], rules)


def extent(place: PagePlacement, size: Size) -> Size:
    return (size[1], size[0]) if place.rotated else size


def assert_sound(packing: Packing, sizes: list[Size], rules: PageRules) -> None:
    """Each rectangle lies inside a page, within its border, and apart from every other."""
    assert len(packing.places) == len(sizes)
    assert {place.page for place in packing.places} == set(range(len(packing.pages)))
    placed = [(p, *extent(p, s)) for p, s in zip(packing.places, sizes, strict=True)]
    for place, width, height in placed:
        page_width, page_height = packing.pages[place.page]
        assert rules.border <= place.x <= page_width - rules.border - width
        assert rules.border <= place.y <= page_height - rules.border - height
        assert rules.rotate or not place.rotated
    gap = rules.padding
    for (a, a_width, a_height), (b, b_width, b_height) in combinations(placed, 2):
        beside = a.x + a_width + gap <= b.x or b.x + b_width + gap <= a.x
        above = a.y + a_height + gap <= b.y or b.y + b_height + gap <= a.y
        assert a.page != b.page or beside or above


def assert_allowed(page: Size, rules: PageRules) -> None:
    assert max(page) <= rules.max_size
    for side in page:
        assert side % rules.multiple_of == 0
        assert not rules.pot or side.bit_count() == 1
    assert not rules.square or page[0] == page[1]


def sprites_of_all_sizes(seed: int, count: int = 300) -> list[Size]:
    """Widths and heights log-normal, as frames of many effects are."""
    drawn = np.random.default_rng(seed).lognormal(4.2, 0.55, (count, 2))
    return [(int(w), int(h)) for w, h in np.clip(np.rint(drawn), 8, 300)]


def occupancy(packing: Packing, sizes: list[Size]) -> float:
    return sum(w * h for w, h in sizes) / sum(w * h for w, h in packing.pages)


@settings(max_examples=40, deadline=None)
@given(sizes=sizes_of_sprites, rules=rules_of_pages)
def test_every_rectangle_has_its_own_place(sizes: list[Size], rules: PageRules) -> None:
    packing = packed(sizes, rules)
    assert_sound(packing, sizes, rules)
    for page in packing.pages:
        assert_allowed(page, rules)


@settings(max_examples=60, deadline=None)
@given(covered=st.integers(1, 5000), sprite=st.integers(1, 40), rules=rules_of_pages)
def test_the_least_area_is_that_of_the_smallest_page_with_so_much_room(
    covered: int, sprite: int, rules: PageRules
) -> None:
    narrowest = sprite + rules.padding
    allowed = [
        width * height
        for width in range(1, MAX_SIZE + 1)
        for height in range(1, MAX_SIZE + 1)
        if rules.page(rules.room(width), rules.room(height)) == (width, height)
        and min(rules.room(width), rules.room(height)) >= narrowest
        and rules.room(width) * rules.room(height) >= covered
    ]
    assert rules.least_area(covered, narrowest) == min(allowed, default=math.inf)


@settings(max_examples=20, deadline=None)
@given(sizes=sizes_of_sprites, rules=rules_of_pages, seed=st.integers(0, 99))
def test_the_order_they_come_in_changes_nothing(
    sizes: list[Size], rules: PageRules, seed: int
) -> None:
    shuffled = random.Random(seed).sample(sizes, len(sizes))
    one, other = packed(sizes, rules), packed(shuffled, rules)
    if len(one.pages) == 1:  # on several pages frames stay together in the order of play
        assert one.pages == other.pages
        assert sorted(zip(sizes, one.places, strict=True)) == sorted(
            zip(shuffled, other.places, strict=True)
        )


def test_equal_frames_take_places_in_playing_order() -> None:
    one = packed([(10, 10)] * 7 + [(20, 5)], PageRules(64))
    assert one == packed([(10, 10)] * 7 + [(20, 5)], PageRules(64))


def test_padding_is_only_between_neighbours() -> None:
    assert packed([(10, 20)], PageRules(20, padding=8)).pages == ((10, 20),)


def test_a_border_goes_all_around() -> None:
    packing = packed([(10, 20)], PageRules(64, border=3, padding=8))
    assert packing.pages == ((16, 26),)
    assert packing.places == (PagePlacement(0, 3, 3),)


def test_equal_sprites_fill_a_page_without_waste() -> None:
    packing = packed([(30, 50)] * 48, PageRules(4096))
    assert [width * height for width, height in packing.pages] == [48 * 30 * 50]


def test_turning_helps_where_it_is_allowed() -> None:
    bars = [(60, 10)] * 3 + [(10, 30)] * 3
    assert len(packed(bars, PageRules(60, rotate=True)).pages) == 1
    packing = packed([(64, 8), (8, 64)], PageRules(64, rotate=True))
    assert packing.pages[0][0] * packing.pages[0][1] == 2 * 64 * 8


@pytest.mark.parametrize(("padding", "least"), [(0, 0.975), (2, 0.93)])
def test_varied_sprites_leave_little_empty(padding: int, least: float) -> None:
    sizes = sprites_of_all_sizes(7)
    packing = packed(sizes, PageRules(2048, padding=padding))
    assert len(packing.pages) == 1
    assert occupancy(packing, sizes) >= least


def test_a_page_is_not_a_strip() -> None:
    width, height = packed(sprites_of_all_sizes(8), PageRules(8192)).pages[0]
    assert max(width, height) <= 3 * min(width, height)


def test_a_few_frames_do_not_make_a_ribbon() -> None:
    width, height = packed(
        [(180 + i, 240 - i) for i in range(13)], PageRules(8192, padding=2)
    ).pages[0]
    assert max(width, height) <= 4 * min(width, height)


def test_two_pages_do_where_their_area_nearly_does() -> None:
    sizes = sprites_of_all_sizes(3)
    packing = packed(sizes, PageRules(1024, padding=2))
    assert len(packing.pages) == 2
    assert_sound(packing, sizes, PageRules(1024, padding=2))


def test_frames_that_need_several_pages_stay_in_playing_order() -> None:
    packing = packed([(20, 30), (18, 31), (19, 29)] * 6, PageRules(64, padding=2))
    pages = [place.page for place in packing.places]
    assert len(packing.pages) > 1
    assert pages == sorted(pages)


def test_order_gives_way_to_fewer_pages() -> None:
    halves_and_wholes = [(64, 32), (64, 64), (64, 32), (64, 64)]
    assert len(packed(halves_and_wholes, PageRules(64)).pages) == 3
