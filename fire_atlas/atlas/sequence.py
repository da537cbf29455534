"""Pack rectangles that belong together, such as the frames of one animation, onto pages.

The same sizes take the same places in whatever order they are given; rectangles of equal size take
theirs in the order given.
"""

from collections.abc import Sequence

from fire_atlas.atlas.page_rules import PageRules, Size
from fire_atlas.atlas.search import FilledPage, Search

TRIES_OF_FULL = 96
"""Number of pages to try when it is known that the page will be nearly full."""


def filled_page(
    padded: Sequence[Size], numbers: Sequence[int], rules: PageRules, tries: int
) -> FilledPage:
    """Return the best page found for the rectangles with these ``numbers``; see ``Search.best``.

    ``padded`` are the sizes of all rectangles, with padding at the right and the bottom.
    """
    page = Search([padded[i] for i in numbers], rules).best(tries)
    placements = (
        placement._replace(number=numbers[placement.number]) for placement in page.placements
    )
    return page._replace(placements=tuple(placements))


def filled_pages(
    padded: Sequence[Size], numbers: Sequence[int], rules: PageRules, tries: int
) -> list[FilledPage]:
    """Place rectangles that one page cannot hold together on as few pages as possible.

    If that takes no extra page, each page holds successive rectangles: a client that reads one page
    at a time can then put an animation together.
    """
    area, room = sum(padded[i][0] * padded[i][1] for i in numbers), rules.room(rules.largest) ** 2
    fewest = -(-area // room)
    runs = _runs(padded, numbers, rules)
    if len(runs) > max(fewest, 2):
        by_size = _by_size(padded, numbers, rules, tries)
        if len(by_size) < len(runs):
            return by_size
    return _in_order(padded, runs, rules, tries)


def _by_size(
    padded: Sequence[Size], numbers: Sequence[int], rules: PageRules, tries: int
) -> list[FilledPage]:
    """Fill each page with the rectangles that fit best, in any order."""
    left, pages = list(numbers), list[FilledPage]()
    while left:
        page = filled_page(padded, left, rules, tries)
        pages.append(page)
        placed = {placement.number for placement in page.placements}
        left = [i for i in left if i not in placed]
    return pages


def _in_order(
    padded: Sequence[Size], runs: list[list[int]], rules: PageRules, tries: int
) -> list[FilledPage]:
    """Fill a page with each run; if one does not fit, its last rectangle moves to the next page."""
    pages, left = list[FilledPage](), list(runs)
    while left:
        run = left.pop(0)
        page = filled_page(padded, run, rules, TRIES_OF_FULL if left else tries)
        if page.unplaced_area:
            left = [run[:-1], [run[-1], *(left.pop(0) if left else [])], *left]
        else:
            pages.append(page)
    return pages


def _runs(padded: Sequence[Size], numbers: Sequence[int], rules: PageRules) -> list[list[int]]:
    """Split the rectangles, in order, into runs that each surely fit on one page."""
    runs, left = list[list[int]](), list(numbers)
    while left:
        runs.append(_run(padded, left, rules))
        left = left[len(runs[-1]) :]
    return runs


def _run(padded: Sequence[Size], numbers: list[int], rules: PageRules) -> list[int]:
    """Return as many rectangles, from the first on, as surely fit on one page."""
    room, here = rules.room(rules.largest) ** 2, list[int]()
    for i in numbers:
        room -= padded[i][0] * padded[i][1]
        if room < 0:
            break
        here.append(i)
    return here[: Search([padded[i] for i in here], rules).leading()]
