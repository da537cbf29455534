"""A grid divides every page evenly: what flipbook shaders count with."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.atlas.grid import pack_grid
from fire_atlas.atlas.pack import Packing
from fire_atlas.atlas.page_rules import PageRules, Size
from fire_atlas.atlas.sheet import CellGrid

sizes_of_sprites = st.lists(
    st.tuples(st.integers(1, 60), st.integers(1, 60)), min_size=1, max_size=40
)
rules_of_pages = st.builds(
    PageRules,
    max_size=st.just(64),
    padding=st.integers(0, 5),
    multiple_of=st.sampled_from([1, 2, 4]),
    pot=st.booleans(),
    square=st.booleans(),
)


def in_grid(sizes: list[Size], rules: PageRules) -> tuple[Packing, CellGrid]:
    """Place the frames of a single animation."""
    return pack_grid(sizes, [range(len(sizes))], rules)


@given(sizes=sizes_of_sprites, rules=rules_of_pages)
def test_every_frame_lies_in_its_own_cell(sizes: list[Size], rules: PageRules) -> None:
    packing, grid = in_grid(sizes, rules)
    for i, (place, (width, height)) in enumerate(zip(packing.places, sizes, strict=True)):
        page, cell = divmod(i, grid.columns * grid.rows)
        row, column = divmod(cell, grid.columns)
        assert place.page == page
        assert place.x >= column * grid.cell_width
        assert place.y >= row * grid.cell_height
        assert place.x + width <= (column + 1) * grid.cell_width
        assert place.y + height <= (row + 1) * grid.cell_height


@given(sizes=sizes_of_sprites, rules=rules_of_pages)
def test_cells_divide_pages_of_an_allowed_size(sizes: list[Size], rules: PageRules) -> None:
    packing, grid = in_grid(sizes, rules)
    assert len(set(packing.pages)) == 1
    width, height = packing.pages[0]
    assert (width, height) == (grid.columns * grid.cell_width, grid.rows * grid.cell_height)
    assert max(width, height) <= rules.max_size
    assert width % rules.multiple_of == height % rules.multiple_of == 0
    assert not rules.pot or (width.bit_count(), height.bit_count()) == (1, 1)
    assert not rules.square or width == height


@given(sizes=sizes_of_sprites, padding=st.integers(0, 5))
def test_half_the_gutter_lies_on_each_side(sizes: list[Size], padding: int) -> None:
    packing, grid = in_grid(sizes, PageRules(4096, padding=padding))
    if len(sizes) > 1:
        assert grid.cell_width == max(width for width, _ in sizes) + padding
        assert (packing.places[0].x, packing.places[0].y) == (padding // 2, padding // 2)
    else:
        assert packing.pages == (sizes[0],)


def test_it_plays_row_by_row() -> None:
    packing, grid = in_grid([(10, 10), (4, 4), (10, 6), (1, 1)], PageRules(64, padding=2))
    assert packing.pages == ((24, 24),)
    assert [(place.x, place.y) for place in packing.places] == [(1, 1), (13, 1), (1, 13), (13, 13)]
    assert (grid.columns, grid.rows) == (2, 2)


@pytest.mark.parametrize("count", [1, 7, 13, 25, 48, 61])
def test_any_number_of_frames_wastes_few_cells(count: int) -> None:
    _, grid = in_grid([(30, 50)] * count, PageRules(4096))
    assert grid.columns * grid.rows - count <= 3


def test_pages_of_powers_of_two_have_such_cells() -> None:
    packing, grid = in_grid([(30, 50)] * 9, PageRules(1024, pot=True))
    assert (grid.cell_width, grid.cell_height) == (32, 64)
    assert packing.pages[0] in {(128, 256), (64, 512), (512, 64)}
    assert grid.columns * grid.rows == 16
