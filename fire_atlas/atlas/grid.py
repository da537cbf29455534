"""Lay frames out in uniform cells, in playing order, row by row, that divide pages evenly."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from fire_atlas.atlas.pack import Packing, PagePlacement
from fire_atlas.atlas.page_rules import PageRules, Size, effective_area
from fire_atlas.atlas.sheet import CellGrid

_MOST_CELLS = 512
"""Most columns, and most rows."""


def pack_grid(sizes: Sequence[Size], rules: PageRules) -> tuple[Packing, CellGrid]:
    """Place ``sizes``, none too large for a page, in cells; all pages are alike.

    Half the padding lies on each side of a cell, so that cells are the page's size divided by
    their number: what flipbook shaders count with.
    """
    shapes = list(_shapes(len(sizes), rules, *_cell(sizes, rules)))
    most = max(shape.cells for shape in shapes)
    pages = math.ceil(len(sizes) / most)
    on_page = math.ceil(len(sizes) / pages)
    shape = min((shape for shape in shapes if shape.cells >= on_page), key=_Shape.cost)
    grid = CellGrid(
        shape.columns, shape.rows, shape.width // shape.columns, shape.height // shape.rows
    )
    gutters = _gutters(sizes, rules, grid)
    places = tuple(_placement(i, grid, gutters) for i in range(len(sizes)))
    return Packing(((shape.width, shape.height),) * pages, places), grid


class _Shape(NamedTuple):
    """A page and how many cells it has."""

    columns: int
    rows: int
    width: int
    height: int

    @property
    def cells(self) -> int:
        """How many frames it holds."""
        return self.columns * self.rows

    def cost(self) -> tuple[float, int]:
        """The smallest page, then the squarest."""
        return effective_area((self.width, self.height)), max(self.width, self.height)


def _cell(sizes: Sequence[Size], rules: PageRules) -> Size:
    """Return the smallest cell, gutter included. A frame alone on its page needs no gutter."""
    gutter = rules.padding if len(sizes) > 1 else 0
    width, height = (max(size[axis] for size in sizes) for axis in (0, 1))
    return min(width + gutter, rules.largest), min(height + gutter, rules.largest)


def _shapes(count: int, rules: PageRules, width: int, height: int) -> Iterator[_Shape]:
    """Yield pages of cells of at least ``width`` × ``height``, of use for ``count`` frames."""
    for columns in range(1, min(count, _MOST_CELLS, rules.largest // width) + 1):
        needed = rules.side(-(-count // columns)) if rules.pot else -(-count // columns)
        for rows in range(1, min(needed, _MOST_CELLS, rules.largest // height) + 1):
            across, down = columns * width, rows * height
            if rules.square:
                side = rules.side(max(across, down), math.lcm(columns, rows))
                sides = side, side
            else:
                sides = rules.side(across, columns), rules.side(down, rows)
            if max(sides) <= rules.largest and not (sides[0] % columns or sides[1] % rows):
                yield _Shape(columns, rows, *sides)


def _gutters(sizes: Sequence[Size], rules: PageRules, grid: CellGrid) -> Size:
    """Return what lies before a frame in its cell: half the padding, if there is room for it."""
    room = grid.cell_width - max(w for w, _ in sizes), grid.cell_height - max(h for _, h in sizes)
    return min(rules.padding, room[0]) // 2, min(rules.padding, room[1]) // 2


def _placement(i: int, grid: CellGrid, gutters: Size) -> PagePlacement:
    page, cell = divmod(i, grid.columns * grid.rows)
    row, column = divmod(cell, grid.columns)
    return PagePlacement(
        page, column * grid.cell_width + gutters[0], row * grid.cell_height + gutters[1]
    )
