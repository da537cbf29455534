"""The skylines of many pages at once: the lower edge of what is taken of each.

All pages of a batch advance together, so that numpy does the work. The ledges of a page are
a doubly linked list in arrays, a row a page; a slot is never used again.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

_LEFT_WALL, _RIGHT_WALL, _FLOOR = 0, 1, 2
"""Slots of the page's own walls, and of the ledge it starts with."""

_WALL = 1 << 16
"""How far the page's walls reach down, px: further than any page."""

_UNUSED = np.int64(1) << 60


class Ledge(NamedTuple):
    """The lowest ledge of each page, the leftmost of equals. All (B,), px, y down.

    Attributes:
        slot: Where it is kept.
        x, y, width: Everything above ``y`` is taken, over the whole width.
        left, right: How much further down the skyline is beside it.
    """

    slot: Indices
    x: Ints
    y: Ints
    width: Ints
    left: Ints
    right: Ints

    def of(self, rows: Indices) -> "Ledge":
        """Return the ledges of some of the pages."""
        return Ledge(*(field[rows] for field in self))


class Skyline:
    """B skylines, each of at most ``most`` ledges over its life."""

    def __init__(self, widths: Ints, most: int) -> None:
        """Start with pages of these widths (B,), px, on which nothing is taken."""
        shape = len(widths), most + 2
        self._rows = np.arange(len(widths))
        self._x, self._y, self._width = (np.zeros(shape, np.int64) for _ in range(3))
        self._before, self._after = np.zeros(shape, np.intp), np.zeros(shape, np.intp)
        self._order = np.full(shape, _UNUSED)  # by y, then x
        self._free = np.full(len(widths), _FLOOR + 1)
        self._y[:, :_FLOOR] = _WALL
        self._before[:, _FLOOR], self._after[:, _FLOOR] = _LEFT_WALL, _RIGHT_WALL
        self._width[:, _FLOOR] = widths
        self._order[:, _FLOOR] = 0

    def lowest(self) -> Ledge:
        """Return the lowest ledge of each page."""
        rows, slot = self._rows, self._order.argmin(axis=1)
        y = self._y[rows, slot]
        left = self._y[rows, self._before[rows, slot]] - y
        right = self._y[rows, self._after[rows, slot]] - y
        return Ledge(slot, self._x[rows, slot], y, self._width[rows, slot], left, right)

    def place(self, rows: Indices, ledge: Ledge, width: Ints, height: Ints) -> Ints:
        """Place a rectangle on the ledge of each of ``rows`` (R,); return its x, px.

        It leans on the wall that reaches further down, or on the one it ends level with. The
        page's left edge counts as the further wall, so that pages end where their last column does.
        """
        ledge = ledge.of(rows)
        leans_left = (ledge.left >= ledge.right) & (height != ledge.right) | (height == ledge.left)
        rest = ledge.width - width
        x = np.where(leans_left, ledge.x, ledge.x + rest)
        split = np.flatnonzero(rest)
        new = self._split(rows[split], ledge.slot[split], leans_left[split])
        rest_x = np.where(leans_left, ledge.x + width, ledge.x)
        self._set(rows[split], new, rest_x[split], ledge.y[split], rest[split])
        self._set(rows, ledge.slot, x, ledge.y + height, width)
        self._join(rows, ledge.slot)
        return x

    def raise_ledges(self, rows: Indices, ledge: Ledge, most: Ints) -> None:
        """Give up the room on the ledges of ``rows`` (R,), because nothing fits there.

        They rise to the lower of their walls, or as far as ``most`` (R,), px.
        """
        ledge = ledge.of(rows)
        y = np.minimum(ledge.y + np.minimum(ledge.left, ledge.right), most)
        self._set(rows, ledge.slot, ledge.x, y, ledge.width)
        self._join(rows, ledge.slot)

    def _set(self, rows: Indices, slot: Indices, x: Ints, y: Ints, width: Ints) -> None:
        self._x[rows, slot], self._y[rows, slot], self._width[rows, slot] = x, y, width
        self._order[rows, slot] = y << 20 | x

    def _split(self, rows: Indices, slot: Indices, after: Flags) -> Indices:
        """Link a new ledge in, ``after`` the one at ``slot`` or before it; return its slot."""
        new = self._free[rows]
        self._free[rows] += 1
        left = np.where(after, slot, self._before[rows, slot])
        right = np.where(after, self._after[rows, slot], slot)
        self._link(rows, left, new)
        self._link(rows, new, right)
        return new

    def _link(self, rows: Indices, left: Indices, right: Indices) -> None:
        self._after[rows, left], self._before[rows, right] = right, left

    def _join(self, rows: Indices, slot: Indices) -> None:
        """Join the ledges at ``slot`` with those beside them that are level."""
        self._absorb(rows, slot, self._before)
        self._absorb(rows, slot, self._after)

    def _absorb(self, rows: Indices, slot: Indices, beside: Indices) -> None:
        level = np.flatnonzero(self._y[rows, beside[rows, slot]] == self._y[rows, slot])
        rows, slot = rows[level], slot[level]
        other = beside[rows, slot]
        self._set(
            rows, slot,
            np.minimum(self._x[rows, slot], self._x[rows, other]),
            self._y[rows, slot],
            self._width[rows, slot] + self._width[rows, other],
        )  # fmt: skip
        self._order[rows, other] = _UNUSED
        beyond = beside[rows, other]
        if beside is self._before:
            self._link(rows, beyond, slot)
        else:
            self._link(rows, slot, beyond)
