"""Pack rectangles onto pages: choose the page of each, and its place there.

The same sizes take the same places in whatever order they are given; rectangles of equal size take
theirs in the order given.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from fire_atlas.atlas.page_rules import PageRules, Size
from fire_atlas.atlas.search import FilledPage, Search


class PagePlacement(NamedTuple):
    """Where a rectangle lies: index of the page, and its top-left corner there, px.

    If ``rotated``, it is turned by 90°: its height lies along x and its width along y.
    """

    page: int
    x: int
    y: int
    rotated: bool = False


@dataclass(frozen=True, slots=True)
class Packing:
    """Sizes of the pages, and the placement of each rectangle, in the order they were given."""

    pages: tuple[Size, ...]
    places: tuple[PagePlacement, ...]


QUICK, THOROUGH = 288, 1152
"""Number of pages to try. Thorough takes four times as long, for about 1 % less to store."""

_TRIES_OF_FULL = 96
"""Number of pages to try when it is known that the page will be nearly full."""


def pack(sizes: Sequence[Size], rules: PageRules, tries: int = QUICK) -> Packing:
    """Place all ``sizes``, none too large for a page, on as few and as small pages as possible.

    If that takes no extra page, each page holds successive rectangles: a client that reads one page
    at a time can then put an animation together.
    """
    padded = [(width + rules.padding, height + rules.padding) for width, height in sizes]
    area, room = sum(w * h for w, h in padded), rules.room(rules.largest) ** 2
    fewest = -(-area // room)
    if fewest == 1:
        whole = Search(padded, rules).best(tries)
        if not whole.unplaced_area:
            return _packing([(list(range(len(sizes))), whole)])
    runs = _runs(padded, rules)
    if len(runs) > max(fewest, 2):
        by_size = _by_size(padded, rules, tries)
        if len(by_size) < len(runs):
            return _packing(by_size)
    return _packing(_in_order(padded, runs, rules, tries))


_Page = tuple[list[int], FilledPage]
"""Indices of the rectangles to place on a page, and the page filled with as many as fitted."""


def _packing(pages: list[_Page]) -> Packing:
    places = {
        numbers[each.number]: PagePlacement(page, each.x, each.y, each.rotated)
        for page, (numbers, filled) in enumerate(pages)
        for each in filled.placements
    }
    return Packing(
        tuple(filled.size for _, filled in pages), tuple(places[i] for i in range(len(places)))
    )


def _by_size(padded: list[Size], rules: PageRules, tries: int) -> list[_Page]:
    """Fill each page with the rectangles that fit best, in any order."""
    numbers, pages = list(range(len(padded))), list[_Page]()
    while numbers:
        page = Search([padded[i] for i in numbers], rules).best(tries)
        pages.append((numbers, page))
        placed = {numbers[each.number] for each in page.placements}
        numbers = [i for i in numbers if i not in placed]
    return pages


def _in_order(
    padded: list[Size], runs: list[list[int]], rules: PageRules, tries: int
) -> list[_Page]:
    """Fill a page with each run; if one does not fit, its last rectangle moves to the next page."""
    pages, left = list[_Page](), list(runs)
    while left:
        run = left.pop(0)
        search = Search([padded[i] for i in run], rules)
        page = search.best(_TRIES_OF_FULL if left else tries)
        if page.unplaced_area:
            left = [run[:-1], [run[-1], *(left.pop(0) if left else [])], *left]
        else:
            pages.append((run, page))
    return pages


def _runs(padded: list[Size], rules: PageRules) -> list[list[int]]:
    """Split the rectangles, in order, into runs that each surely fit on one page."""
    runs, start = list[list[int]](), 0
    while start < len(padded):
        runs.append(_run(padded, start, rules))
        start += len(runs[-1])
    return runs


def _run(padded: list[Size], start: int, rules: PageRules) -> list[int]:
    """Return the indices of as many rectangles from ``start`` on as surely fit on one page."""
    room, here = rules.room(rules.largest) ** 2, list[int]()
    for i in range(start, len(padded)):
        room -= padded[i][0] * padded[i][1]
        if room < 0:
            break
        here.append(i)
    return here[: Search([padded[i] for i in here], rules).leading()]
