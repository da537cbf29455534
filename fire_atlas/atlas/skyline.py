"""Fill one page from the top, always at the lowest point of its skyline.

Best-fit after Burke, Kendall and Whitwell, "A new placement heuristic for the orthogonal
stock-cutting problem" (2004): not the next rectangle chooses its place, but the lowest gap
chooses its rectangle, the widest that fits.
"""

from bisect import bisect_left
from collections.abc import Iterable
from typing import NamedTuple


class Rect(NamedTuple):
    """Something to place: its number, and its size in px with padding at its right and bottom."""

    number: int
    width: int
    height: int


class _Ledge(NamedTuple):
    """A level part of the skyline: everything above ``y`` is taken. px, y down."""

    x: int
    y: int
    width: int


class Placed(NamedTuple):
    """A rectangle and where its top-left corner went, px."""

    rect: Rect
    x: int
    y: int


def fill(rects: Iterable[Rect], width: int, height: int) -> list[Placed]:
    """Place as many of ``rects`` as best-fit finds room for on ``width`` × ``height`` px."""
    left = sorted(rects, key=lambda rect: (rect.width, rect.height, -rect.number))
    ledges = [_Ledge(0, 0, width)]
    placed = []
    while left:
        at = min(range(len(ledges)), key=lambda i: (ledges[i].y, ledges[i].x))
        ledge = ledges[at]
        if ledge.y >= height:
            break
        chosen = _widest(left, ledge.width, height - ledge.y)
        if chosen is None:
            _raise(ledges, at, height)
            continue
        rect = left.pop(chosen)
        x = _beside_the_higher_wall(ledges, at, rect.width)
        placed.append(Placed(rect, x, ledge.y))
        _cover(ledges, at, x, rect)
    return placed


def _widest(rects: list[Rect], width: int, height: int) -> int | None:
    """Return which of sorted ``rects`` is the widest that fits, the highest of equals."""
    fitting = bisect_left(rects, width + 1, key=lambda rect: rect.width)
    return next((i for i in range(fitting - 1, -1, -1) if rects[i].height <= height), None)


def _beside_the_higher_wall(ledges: list[_Ledge], at: int, width: int) -> int:
    """Return x on the ledge such that the rectangle leans on the side that reaches further down.

    The page's left edge is the highest wall and its right edge none, so that pages end where
    their last column does.
    """
    ledge = ledges[at]
    left_wall = ledges[at - 1].y if at else float("inf")
    right_wall = ledges[at + 1].y if at + 1 < len(ledges) else 0
    return ledge.x if left_wall >= right_wall else ledge.x + ledge.width - width


def _cover(ledges: list[_Ledge], at: int, x: int, rect: Rect) -> None:
    """Put the rectangle, which lies at ``x``, into the skyline."""
    ledge = ledges[at]
    top = _Ledge(x, ledge.y + rect.height, rect.width)
    rest = ledge.width - rect.width
    if not rest:
        ledges[at] = top
    elif x == ledge.x:
        ledges[at : at + 1] = [top, _Ledge(x + rect.width, ledge.y, rest)]
    else:
        ledges[at : at + 1] = [_Ledge(ledge.x, ledge.y, rest), top]
    _merge_around(ledges, at)


def _raise(ledges: list[_Ledge], at: int, height: int) -> None:
    """Give up the room above a ledge: nothing fits, so it rises to its lower neighbour."""
    beside = [ledges[i].y for i in (at - 1, at + 1) if 0 <= i < len(ledges)]
    ledges[at] = ledges[at]._replace(y=min(beside, default=height))
    _merge_around(ledges, at)


def _merge_around(ledges: list[_Ledge], at: int) -> None:
    """Join ledges of one level near ``at``."""
    for i in range(min(at + 2, len(ledges) - 1), max(at - 1, 0), -1):
        if ledges[i - 1].y == ledges[i].y:
            joined = ledges[i - 1].width + ledges[i].width
            ledges[i - 1 : i + 1] = [ledges[i - 1]._replace(width=joined)]
