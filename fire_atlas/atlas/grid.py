"""Place frames in the equal cells of a grid, row by row in playing order; cells fill the page."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from fire_atlas.atlas.pack import Packing, PagePlacement
from fire_atlas.atlas.page_rules import PageRules, Size, effective_area
from fire_atlas.atlas.sheet import CellGrid

_MAX_CELLS = 512
"""Maximum number of columns, and of rows."""


def pack_grid(sizes: Sequence[Size], rules: PageRules) -> tuple[Packing, CellGrid]:
    """Place ``sizes``, none too large for a page, in cells; all pages have the same grid.

    Half the padding lies on each side of a cell, so that the cell size is the page size divided by
    the number of cells, as flipbook shaders assume.
    """
    shapes = list(_shapes(len(sizes), rules, *_cell(sizes, rules)))
    pages = math.ceil(len(sizes) / max(shape.cells for shape in shapes))
    on_page = math.ceil(len(sizes) / pages)
    shape = min((shape for shape in shapes if shape.cells >= on_page), key=_Shape.cost)
    grid = CellGrid(
        shape.columns, shape.rows, shape.width // shape.columns, shape.height // shape.rows
    )
    gutters = _gutters(sizes, rules, grid)
    places = tuple(_placement(i, grid, gutters) for i in range(len(sizes)))
    return Packing(((shape.width, shape.height),) * pages, places), grid


class _Shape(NamedTuple):
    """The size of a page, px, and its number of columns and rows."""

    columns: int
    rows: int
    width: int
    height: int

    @property
    def cells(self) -> int:
        """The number of frames that the page holds."""
        return self.columns * self.rows

    def cost(self) -> tuple[float, int]:
        """Sort key: the smallest page is best, then the squarest."""
        return effective_area((self.width, self.height)), max(self.width, self.height)


def _cell(sizes: Sequence[Size], rules: PageRules) -> Size:
    """Return the smallest cell for the frames and a gutter, which a single frame does not need."""
    gutter = rules.padding if len(sizes) > 1 else 0
    width, height = (max(size[axis] for size in sizes) for axis in (0, 1))
    return min(width + gutter, rules.largest), min(height + gutter, rules.largest)


def _shapes(count: int, rules: PageRules, width: int, height: int) -> Iterator[_Shape]:
    """Yield all useful pages for ``count`` frames with cells of at least ``width`` × ``height``."""
    for columns in range(1, min(count, _MAX_CELLS, rules.largest // width) + 1):
        needed = rules.side(-(-count // columns)) if rules.pot else -(-count // columns)
        for rows in range(1, min(needed, _MAX_CELLS, rules.largest // height) + 1):
            across, down = columns * width, rows * height
            if rules.square:
                side = rules.side(max(across, down), math.lcm(columns, rows))
                sides = side, side
            else:
                sides = rules.side(across, columns), rules.side(down, rows)
            if max(sides) <= rules.largest and not (sides[0] % columns or sides[1] % rows):
                yield _Shape(columns, rows, *sides)


def _gutters(sizes: Sequence[Size], rules: PageRules, grid: CellGrid) -> Size:
    """Return the offset (x, y) of a frame in its cell: half the padding, if there is room."""
    room = grid.cell_width - max(w for w, _ in sizes), grid.cell_height - max(h for _, h in sizes)
    return min(rules.padding, room[0]) // 2, min(rules.padding, room[1]) // 2


def _placement(i: int, grid: CellGrid, gutters: Size) -> PagePlacement:
    page, cell = divmod(i, grid.columns * grid.rows)
    row, column = divmod(cell, grid.columns)
    return PagePlacement(
        page, column * grid.cell_width + gutters[0], row * grid.cell_height + gutters[1]
    )
