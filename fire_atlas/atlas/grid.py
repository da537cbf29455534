"""Place frames in the equal cells of a grid, row by row in playing order; cells fill the page."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from fire_atlas.atlas.assignment import Assignment, Frames, assign
from fire_atlas.atlas.pack import Packing, PagePlacement
from fire_atlas.atlas.page_rules import PageRules, Size, effective_area
from fire_atlas.atlas.sheet import CellGrid

_MAX_CELLS = 512
"""Maximum number of columns, and of rows."""


def pack_grid(
    sizes: Sequence[Size], animations: Sequence[Sequence[int]], rules: PageRules
) -> tuple[Packing, CellGrid]:
    """Place frames, none too large for a page, in cells; all pages have the same grid.

    An animation goes on one page if a page can hold it. Half the padding lies on each side of a
    cell, so that the cell size is the page size divided by the number of cells, as flipbook shaders
    assume.

    Args:
        sizes: Width and height of each frame.
        animations: Of each animation, the indices of its frames: 0, 1, ... over all animations.
        rules: Limits on pages.
    """
    shapes = sorted(_shapes(len(sizes), rules, *_cell(sizes, rules)), key=_Shape.cost)
    shape, assignment = _smallest_pages(shapes, animations)
    grid = CellGrid(
        shape.columns, shape.rows, shape.width // shape.columns, shape.height // shape.rows
    )
    gutters = _gutters(sizes, rules, grid)
    places = {
        frame: _placement(page, cell, grid, gutters)
        for page, frames in enumerate(assignment.pages)
        for cell, frame in enumerate(sorted(frames))
    }
    pages = ((shape.width, shape.height),) * len(assignment.pages)
    return Packing(pages, tuple(places[i] for i in range(len(sizes)))), grid


def grid_pages(
    sizes: Sequence[Size], animations: Sequence[Sequence[int]], rules: PageRules
) -> float:
    """Return how many pages ``pack_grid`` needs; infinity if no page can hold the cells that the
    recipe states."""
    shapes = _shapes(sum(map(len, animations)), rules, *_cell(sizes, rules))
    most = max((shape.cells for shape in shapes), default=0)
    return len(assign(animations, _GridRoom(most)).pages) if most else math.inf


def stated_page(sizes: Sequence[Size], rules: PageRules) -> Size:
    """Return the smallest page with as many cells as the recipe states, even above ``max_size``."""
    columns, rows = rules.cells or (1, 1)
    return _page(columns, rows, rules, *_cell(sizes, rules))


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


@dataclass(frozen=True, slots=True)
class _GridRoom:
    """The room on a page of a grid; a frame takes an area of one cell."""

    capacity: int

    def area(self, frames: Collection[int]) -> int:
        """Return the number of frames."""
        return len(frames)

    def size(self, frame: int) -> tuple[int, int]:
        """Return a cell's size, in cells: all frames take the same room."""
        del frame
        return (1, 1)

    def holds(self, frames: frozenset[int]) -> bool:
        """Whether there are enough cells."""
        return len(frames) <= self.capacity

    def divided(self, frames: Frames) -> list[Frames]:
        """Return the frames of each page if only these are placed."""
        return [frames[i : i + self.capacity] for i in range(0, len(frames), self.capacity)]


def _smallest_pages(
    shapes: Sequence[_Shape], animations: Sequence[Sequence[int]]
) -> tuple[_Shape, Assignment]:
    """Return the first of ``shapes`` with which pages are fewest, and the frames on each page.

    It has to hold every animation that the one with the most cells holds.
    """
    most = max(shape.cells for shape in shapes)
    fewest = len(assign(animations, _GridRoom(most)).pages)
    frames = sum(map(len, animations))
    least = max((len(animation) for animation in animations if len(animation) <= most), default=1)
    for shape in shapes:
        if shape.cells >= max(least, frames / fewest):
            assignment = assign(animations, _GridRoom(shape.cells))
            if len(assignment.pages) <= fewest:
                return shape, assignment
    raise AssertionError("the shape with the most cells takes the fewest pages")


def _cell(sizes: Sequence[Size], rules: PageRules) -> Size:
    """Return the smallest cell for the frames and a gutter, which a single frame does not need."""
    gutter = rules.padding if len(sizes) > 1 else 0
    width, height = (max(size[axis] for size in sizes) for axis in (0, 1))
    return min(width + gutter, rules.largest), min(height + gutter, rules.largest)


def _shapes(count: int, rules: PageRules, width: int, height: int) -> Iterator[_Shape]:
    """Yield all useful pages for ``count`` frames with cells of at least ``width`` × ``height``."""
    for columns, rows in _cells(count, rules, width, height):
        sides = _page(columns, rows, rules, width, height)
        if max(sides) <= rules.largest and not (sides[0] % columns or sides[1] % rows):
            yield _Shape(columns, rows, *sides)


def _cells(count: int, rules: PageRules, width: int, height: int) -> Iterator[Size]:
    """Yield the useful numbers of columns and rows: those that the recipe states, if it does."""
    if rules.cells is not None:
        yield rules.cells
        return
    for columns in range(1, min(count, _MAX_CELLS, rules.largest // width) + 1):
        needed = rules.side(-(-count // columns)) if rules.pot else -(-count // columns)
        for rows in range(1, min(needed, _MAX_CELLS, rules.largest // height) + 1):
            yield columns, rows


def _page(columns: int, rows: int, rules: PageRules, width: int, height: int) -> Size:
    """Return the smallest page with such cells, even above ``max_size``."""
    across, down = columns * width, rows * height
    if rules.square:
        return (rules.side(max(across, down), math.lcm(columns, rows)),) * 2
    return rules.side(across, columns), rules.side(down, rows)


def _gutters(sizes: Sequence[Size], rules: PageRules, grid: CellGrid) -> Size:
    """Return the offset (x, y) of a frame in its cell: half the padding, if there is room."""
    room = grid.cell_width - max(w for w, _ in sizes), grid.cell_height - max(h for _, h in sizes)
    return min(rules.padding, room[0]) // 2, min(rules.padding, room[1]) // 2


def _placement(page: int, cell: int, grid: CellGrid, gutters: Size) -> PagePlacement:
    row, column = divmod(cell, grid.columns)
    return PagePlacement(
        page, column * grid.cell_width + gutters[0], row * grid.cell_height + gutters[1]
    )
