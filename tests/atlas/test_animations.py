"""An animation lies on one page if a page can hold it, and pages are few all the same."""

import random
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.atlas.grid import grid_pages, pack_grid
from fire_atlas.atlas.pack import Packing, fits_pages, pack
from fire_atlas.atlas.page_rules import PageRules, Size
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.remedies import PageFrames, split_animations, sufficient_size
from fire_atlas.atlas.sheet import AnimationFrames
from fire_atlas.core.pixels import Pixels
from fire_atlas.recipe.output import Atlas
from tests.atlas.frames import cut
from tests.atlas.frames import frames as clips
from tests.atlas.test_pack import assert_allowed, assert_sound, rules_of_pages
from tests.support.animations import numbered, random_animations
from tests.support.sheets import animation_of

FEW_TRIES = 16
UNLIMITED = 16384

small_animations = st.lists(
    st.lists(st.tuples(st.integers(1, 40), st.integers(1, 40)), min_size=1, max_size=8),
    min_size=1,
    max_size=6,
)


def pages_of(packing: Packing, animations: list[list[Size]]) -> list[set[int]]:
    """Return the pages that each animation is on."""
    places = iter(packing.places)
    return [{place.page for place in islice(places, len(each))} for each in animations]


def packed(animations: list[list[Size]], rules: PageRules) -> Packing:
    sizes = [size for each in animations for size in each]
    return pack(sizes, numbered(animations), rules, FEW_TRIES)


def surely_fits(sizes: list[Size], rules: PageRules) -> bool:
    """Whether the frames fit on a page in rows, each as high as its highest frame."""
    side = rules.largest - 2 * rules.border
    x = y = row = 0
    for width, height in sorted(sizes, key=lambda size: -size[1]):
        if x + width > side:
            x, y, row = 0, y + row + rules.padding, 0
        x, row = x + width + rules.padding, max(row, height)
        if y + row > side:
            return False
    return True


def fits_an_unlimited_page(sizes: list[Size], max_size: int) -> bool:
    """Whether the smallest page for these frames alone turns out to be small enough."""
    return any(
        max(pack(sizes, [range(len(sizes))], rules, FEW_TRIES).pages[0]) <= max_size
        for rules in (
            PageRules(UNLIMITED, padding=2),
            PageRules(UNLIMITED, padding=2, square=True),
        )
    )


@pytest.mark.parametrize("seed", range(18))
def test_no_animation_that_a_page_could_hold_is_split(seed: int) -> None:
    animations = random_animations(seed)
    max_size = (512, 1024, 2048)[seed % 3]
    on_pages = pages_of(packed(animations, PageRules(max_size, padding=2)), animations)
    split = [each for each, on in zip(animations, on_pages, strict=True) if len(on) > 1]
    assert not any(fits_an_unlimited_page(sizes, max_size) for sizes in split)


@settings(max_examples=60, deadline=None)
@given(animations=small_animations, rules=rules_of_pages)
def test_every_frame_has_its_own_place_under_any_rules(
    animations: list[list[Size]], rules: PageRules
) -> None:
    packing = packed(animations, rules)
    assert_sound(packing, [size for each in animations for size in each], rules)
    for page in packing.pages:
        assert_allowed(page, rules)
    for sizes, on in zip(animations, pages_of(packing, animations), strict=True):
        assert len(on) == 1 or not surely_fits(sizes, rules)


@settings(max_examples=30, deadline=None)
@given(animations=small_animations, seed=st.integers(0, 99))
@example([[(1, 1)], [(28, 25)], [(37, 40)]], 0)
@example(  # two of one area
    [
        [(1, 7), (1, 40), (2, 12), (3, 30), (5, 15), (6, 23), (40, 40)],
        [(1, 1)],
        [(2, 23), (4, 15), (5, 40), (6, 16), (8, 33), (12, 35), (16, 24), (18, 28)],
    ],
    0,
)
def test_the_order_of_animations_does_not_decide_which_share_a_page(
    animations: list[list[Size]], seed: int
) -> None:
    animations = [sorted(each) for each in animations]
    shuffled = random.Random(seed).sample(animations, len(animations))
    one, other = (packed(each, PageRules(64)) for each in (animations, shuffled))
    if all(len(on) == 1 for on in pages_of(one, animations)):
        assert sorted(one.pages) == sorted(other.pages)


def test_all_animations_on_one_page_lie_there_as_if_they_were_one() -> None:
    animations = random_animations(3)[:3]
    sizes = [size for each in animations for size in each]
    rules = PageRules(4096, padding=2)
    assert packed(animations, rules) == pack(sizes, [range(len(sizes))], rules, FEW_TRIES)


def test_animations_are_not_divided_to_fill_a_page() -> None:
    halves = [[(64, 10)] * 3] * 4  # two of them on a page of 64 x 64, and 4 px are left
    packing = packed(halves, PageRules(64))
    assert [len(on) for on in pages_of(packing, halves)] == [1, 1, 1, 1]
    assert packing.pages == ((64, 60), (64, 60))


def test_what_no_page_can_hold_stays_in_order_and_fills_the_gaps() -> None:
    long, short = [(64, 16)] * 5, [(64, 16)] * 2
    packing = packed([long, short, short], PageRules(64))
    assert [len(on) for on in pages_of(packing, [long, short, short])] == [2, 1, 1]
    assert [place.page for place in packing.places[:4]] == [0] * 4
    assert len(packing.pages) == 3
    long = [(64, 16)] * 6
    three = [(64, 16)] * 3
    packing = packed([long, three, three], PageRules(64))
    assert len(packing.pages) == 3  # the last two frames fill a gap each
    assert [len(on) for on in pages_of(packing, [long, three, three])] == [3, 1, 1]


def test_sprites_of_one_frame_fill_any_gap() -> None:
    animations: list[list[Size]] = [[(64, 24)] * 2, *[[(64, 8)]] * 12, [(64, 24)] * 2]
    packing = packed(animations, PageRules(64))
    assert packing.pages == ((64, 64), (64, 64), (64, 64))


def test_a_shared_frame_is_stored_once_on_each_page_that_shows_it() -> None:
    sizes = [(64, 20)] * 5
    packing = pack(sizes, [[0, 1, 2], [0, 3, 4], [0, 1, 0]], PageRules(64))
    first, second, third = (packing.places[i : i + 3] for i in (0, 3, 6))
    assert packing.pages == ((64, 60), (64, 60))
    assert {place.page for place in first} == {place.page for place in third} == {0}
    assert {place.page for place in second} == {1}
    assert (third[0], third[1], third[2]) == (first[0], first[1], first[0])
    assert len(set(second)) == 3


@settings(max_examples=30, deadline=None)
@given(
    clip=clips(12),
    animations=st.lists(
        st.lists(st.integers(0, 11), min_size=1, max_size=7), min_size=2, max_size=6
    ),
    scales=st.sampled_from([(1.0,), (1.0, 0.5)]),
)
def test_pages_show_every_frame_of_animations_that_share_some(
    clip: list[Pixels], animations: list[list[int]], scales: tuple[float, ...]
) -> None:
    atlas = Atlas.model_validate({"max_size": 52, "scales": scales})
    encoded = [encode_sprites(pixels, atlas) for pixels in clip]
    played = [[encoded[i % len(clip)] for i in each] for each in animations]
    frames = [
        AnimationFrames(f"a{i}", tuple(sprites[0] for sprites in each), 40, True, None)
        for i, each in enumerate(played)
    ]
    shown = [sprites for each in played for sprites in each]
    for scale, sheet in enumerate(build_sheets("all", frames, atlas)):
        sprites, edges = [each[scale] for each in shown], Edges.of(atlas, sheet.scale)
        pages = [draw_page(sheet, i, sprites, edges) for i in range(len(sheet.pages))]
        for region, sprite in zip(sheet.regions, sprites, strict=True):
            frame = np.zeros((region.frame_height, region.frame_width, 4), np.uint8)
            height, width = sprite.image.shape[:2]
            frame[sprite.y : sprite.y + height, sprite.x : sprite.x + width] = sprite.image
            np.testing.assert_array_equal(cut(region, pages), frame)


@settings(deadline=None)
@given(animations=small_animations, pot=st.booleans(), padding=st.integers(0, 4))
def test_an_animation_has_one_page_of_a_grid_if_it_has_enough_cells(
    animations: list[list[Size]], pot: bool, padding: int
) -> None:
    sizes = [size for each in animations for size in each]
    rules = PageRules(128, pot=pot, padding=padding)
    packing, grid = pack_grid(sizes, numbered(animations), rules)
    assert_sound(packing, sizes, PageRules(128, pot=pot))
    cells = grid.columns * grid.rows
    on_pages = pages_of(packing, animations)
    for frames, on in zip(animations, on_pages, strict=True):
        assert len(on) == 1 or len(frames) > cells
    assert grid_pages(sizes, numbered(animations), rules) == len(packing.pages)


def test_pages_of_a_grid_are_as_small_as_the_animations_allow() -> None:
    animations: list[list[Size]] = [[(10, 10)] * 4] * 5
    packing, grid = pack_grid([(10, 10)] * 20, numbered(animations), PageRules(45))
    assert len(packing.pages) == 2  # which could have 16 cells, but three animations take 12
    assert {grid.columns, grid.rows} == {3, 4}


@settings(max_examples=20, deadline=None)
@given(animations=small_animations, rules=rules_of_pages)
def test_frames_that_are_said_to_fit_do(animations: list[list[Size]], rules: PageRules) -> None:
    sizes = [size for each in animations for size in each]
    needed = len(pack(sizes, numbered(animations), rules).pages)
    fitting = [fits_pages(sizes, numbered(animations), rules, n) for n in range(1, needed + 3)]
    assert not any(fitting[: needed - 1])
    assert fitting == sorted(fitting) and fitting[-1]


HARD_TO_FIT = [
    (4, 4), (4, 15), (7, 4), (7, 4), (7, 7), (7, 31), (11, 27), (15, 4), (23, 39), (27, 7),
    (27, 15), (27, 19), (27, 27), (27, 31), (27, 35), (31, 35), (31, 35), (35, 7),
]  # fmt: skip
"""Frames of which the fullest pages leave some for a fourth, where three hold them all."""


@settings(max_examples=20, deadline=None)
@given(
    sizes=st.lists(st.tuples(st.integers(4, 40), st.integers(4, 40)), min_size=9, max_size=30),
    keys=st.sampled_from(
        [{}, {"layout": "grid"}, {"pot": True}, {"border": 3}, {"gpu": ["bc7.dds"], "mips": 1}]
    ),
    pages=st.integers(1, 3),
)
@example(sizes=HARD_TO_FIT, keys={"gpu": ["bc7.dds"], "mips": 1}, pages=3)
def test_a_page_of_the_size_that_is_advised_is_large_enough(
    sizes: list[Size], keys: dict[str, Any], pages: int
) -> None:
    atlas = Atlas.model_validate({"max_size": 64, "dedupe": False, **keys})
    frames = PageFrames(tuple(sizes), (range(len(sizes)),))
    if frames.fit(atlas, pages):
        return
    size = sufficient_size(frames, atlas, pages)
    assert size is not None and size > 64
    larger = Atlas.model_validate({**keys, "max_size": size, "dedupe": False})
    (sheet,) = build_sheets("all", [animation_of(sizes, "all")], larger)
    assert len(sheet.pages) <= pages


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"scales": [1, 0.25]},
        {"extrude": 2, "border": 3, "padding": 4},
        {"rotate": True, "trim": "none"},
        {"pot": True, "square": True},
        {"multiple_of": 4, "trim": "animation"},
        {"layout": "grid"},
    ],
)
def test_sheets_keep_animations_together_with_all_settings(keys: dict[str, Any]) -> None:
    chance = np.random.default_rng(6)
    sizes = [
        [(int(w), int(h)) for w, h in chance.integers(8, 50, (count, 2))]
        for count in (9, 12, 6, 90, 8)
    ]
    frames = [
        replace(animation_of(each, f"a{i}", seed=i), margin=2) for i, each in enumerate(sizes)
    ]
    atlas = Atlas.model_validate({"max_size": 256, "dedupe": False, **keys})
    sheets = build_sheets("all", frames, atlas)
    alone = [build_sheets(each.name, [each], atlas)[0] for each in frames]
    needs_several = [each.title for each in alone if len(each.pages) > 1]
    for sheet in sheets:
        split = split_animations(sheet)
        assert [sheet.animations[i].name for i in split] == needs_several == ["a3"]
    size = sufficient_size(PageFrames.of(sheets[0]).alone(3), atlas)
    assert size is not None and size > 256
    larger = Atlas.model_validate({**keys, "max_size": size, "dedupe": False})
    assert split_animations(build_sheets("all", frames, larger)[0]) == []
