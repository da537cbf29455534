"""Decide where rectangles go: on which page, and where on it. Sizes in px, no pixels here."""

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from fire_atlas.atlas.skyline import Placed, Rect, fill
from fire_atlas.core.errors import OutputError

Layout = Literal["packed", "grid"]
Size = tuple[int, int]
"""Width and height, px."""

_SHAPES = tuple(0.5 * 2 ** (step / 32) for step in range(65))
"""Page widths that are tried, in units of the side of a square that holds all rectangles."""


class Place(NamedTuple):
    """Where a rectangle went: index of the page, and its top-left corner there, px."""

    page: int
    x: int
    y: int


@dataclass(frozen=True, slots=True)
class Packing:
    """Sizes of the pages, and one place for each rectangle, in the order they were given."""

    pages: tuple[Size, ...]
    places: tuple[Place, ...]


def pack(sizes: Sequence[Size], max_size: int, padding: int, layout: Layout) -> Packing:
    """Place all ``sizes`` on the fewest pages no side of which exceeds ``max_size``.

    Neighbours keep ``padding`` px between them. ``grid`` gives every rectangle a cell of the same
    size, row by row in the given order; ``packed`` the smallest pages that were found.
    """
    _refuse_too_large(sizes, max_size)
    if layout == "grid":
        return _grid(sizes, max_size, padding)
    rects = [Rect(i, w + padding, h + padding) for i, (w, h) in enumerate(sizes)]
    pages = _pages(rects, max_size + padding)
    extents = map(_extent, pages)
    places = {
        put.rect.number: Place(i, put.x, put.y) for i, page in enumerate(pages) for put in page
    }
    return Packing(
        tuple((width - padding, height - padding) for width, height in extents),
        tuple(places[i] for i in range(len(sizes))),
    )


def _refuse_too_large(sizes: Sequence[Size], max_size: int) -> None:
    for i, (width, height) in enumerate(sizes):
        if max(width, height) > max_size:
            raise OutputError(
                f"frame {i} is {width} × {height} px, but a page may only be {max_size} px wide "
                f"and high: raise `atlas.max_size` to {max(width, height)} or more, or make the "
                f"frames smaller with `source.height`"
            )


def _grid(sizes: Sequence[Size], max_size: int, padding: int) -> Packing:
    cell_width = max(width for width, _ in sizes) + padding
    cell_height = max(height for _, height in sizes) + padding
    most_columns = (max_size + padding) // cell_width
    most_rows = (max_size + padding) // cell_height
    pages = math.ceil(len(sizes) / (most_columns * most_rows))
    on_page = math.ceil(len(sizes) / pages)

    def cost(columns: int) -> tuple[int, int]:
        """Fewest empty cells, then the squarest page."""
        rows = math.ceil(on_page / columns)
        return columns * rows, max(columns * cell_width, rows * cell_height)

    columns = min(range(math.ceil(on_page / most_rows), most_columns + 1), key=cost)
    rows = math.ceil(on_page / columns)
    places = []
    for i in range(len(sizes)):
        page, cell = divmod(i, columns * rows)
        row, column = divmod(cell, columns)
        places.append(Place(page, column * cell_width, row * cell_height))
    size = (columns * cell_width - padding, rows * cell_height - padding)
    return Packing((size,) * (places[-1].page + 1), tuple(places))


def _pages(rects: list[Rect], limit: int) -> list[list[Placed]]:
    """Place all of ``rects`` on pages of at most ``limit`` px a side.

    Where it costs no further page, a page holds frames that play one after the other: a client
    that knows only its own page's part of an animation can then join the parts.
    """
    if whole := _smallest(rects, limit):
        return [whole]
    return min(_in_order(rects, limit), _by_size(rects, limit), key=len)


def _smallest(rects: list[Rect], limit: int) -> list[Placed] | None:
    """Return the page of the smallest area that holds all of ``rects``, if one does."""
    side = math.sqrt(sum(rect.width * rect.height for rect in rects))
    if side > limit:
        return None
    widest = max(rect.width for rect in rects)
    widths = {min(max(round(side * shape), widest), limit) for shape in _SHAPES}
    tried = (fill(rects, width, limit) for width in sorted(widths))
    return min((page for page in tried if len(page) == len(rects)), key=_cost, default=None)


def _cost(page: list[Placed]) -> tuple[int, int]:
    """Smallest area, then the squarest."""
    width, height = _extent(page)
    return width * height, max(width, height)


def _extent(page: list[Placed]) -> Size:
    """Return the size of what is used of a page, px, with the padding at its right and bottom."""
    return (
        max(put.x + put.rect.width for put in page),
        max(put.y + put.rect.height for put in page),
    )


def _in_order(rects: list[Rect], limit: int) -> list[list[Placed]]:
    """Fill each page with as many consecutive rectangles as it holds."""
    pages = []
    while rects:
        count = _leading(rects, limit)
        pages.append(_best(rects[:count], limit))
        rects = rects[count:]
    return pages


def _leading(rects: list[Rect], limit: int) -> int:
    """Return how many of ``rects``, from the first on, fit on one page."""
    too_many = range(2, len(rects) + 1)
    return 1 + bisect_left(too_many, True, key=lambda n: len(fill(rects[:n], limit, limit)) < n)


def _by_size(rects: list[Rect], limit: int) -> list[list[Placed]]:
    """Fill each page with whatever fits best."""
    pages = []
    while rects:
        pages.append(_best(rects, limit))
        placed = {put.rect.number for put in pages[-1]}
        rects = [rect for rect in rects if rect.number not in placed]
    return pages


def _best(rects: list[Rect], limit: int) -> list[Placed]:
    """Return the smallest page for all of ``rects``, or else a full one for part of them."""
    return _smallest(rects, limit) or fill(rects, limit, limit)
