"""The skylines of many pages at once: the lower edge of the area taken on each page.

All pages of a batch are filled in step, so that numpy does the work. The ledges of a page are a
doubly linked list in arrays; a slot is never reused.
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
"""Length of the page's walls, px: longer than any page."""

_UNUSED = np.int64(1) << 60
"""Sort key of a slot without a ledge."""


class Ledge(NamedTuple):
    """The ledge with the least y of each page, the leftmost of equals. All (B,), px, y down.

    Attributes:
        slot: Its index in the flat arrays of all pages.
        x, y, width: From ``x`` on, over ``width``, everything above ``y`` is taken.
        left, right: Length of the walls beside it: how much further down the skyline is there.
    """

    slot: Indices
    x: Ints
    y: Ints
    width: Ints
    left: Ints
    right: Ints

    def of(self, rows: Indices) -> "Ledge":
        """Return the ledges of some of the pages."""
        return Ledge(*(field.take(rows) for field in self))


class Skyline:
    """The skylines of B pages.

    The ledges of page b are at b · ``_slots`` and after it in flat arrays, whose elements numpy
    finds in a third of the time of those of a table.
    """

    def __init__(self, widths: Ints, max_ledges: int) -> None:
        """Start with empty pages of these ``widths`` (B,), px; each may create ``max_ledges``."""
        self._slots = max_ledges + 2
        shape = len(widths), self._slots
        first = np.arange(len(widths)) * self._slots
        self._first = first
        x, y, width = (np.zeros(shape, np.int64) for _ in range(3))
        before, after = np.zeros(shape, np.intp), np.zeros(shape, np.intp)
        order = np.full(shape, _UNUSED)  # by y, then x
        y[:, :_FLOOR] = _WALL
        before[:, _FLOOR], after[:, _FLOOR] = first + _LEFT_WALL, first + _RIGHT_WALL
        width[:, _FLOOR] = widths
        order[:, _FLOOR] = 0
        self._x, self._y, self._width = x.ravel(), y.ravel(), width.ravel()
        self._before, self._after = before.ravel(), after.ravel()
        self._order, self._orders = order.ravel(), order
        self._free = first + _FLOOR + 1

    def lowest(self) -> Ledge:
        """Return the ledge with the least y of each page."""
        slot = self._orders.argmin(axis=1) + self._first
        y = self._y.take(slot)
        left = self._y.take(self._before.take(slot)) - y
        right = self._y.take(self._after.take(slot)) - y
        return Ledge(slot, self._x.take(slot), y, self._width.take(slot), left, right)

    def place(self, rows: Indices, ledge: Ledge, width: Ints, height: Ints) -> Ints:
        """Place a rectangle on the ledge of each of ``rows`` (R,); return its x, px.

        It is put against the longer wall, or against the one it ends level with. The page's left
        edge counts as the longest wall, so that the page can end at its last column.
        """
        ledge = ledge.of(rows)
        leans_left = (ledge.left >= ledge.right) & (height != ledge.right) | (height == ledge.left)
        rest = ledge.width - width
        x = np.where(leans_left, ledge.x, ledge.x + rest)
        split = rest.nonzero()[0]
        new = self._split(rows.take(split), ledge.slot.take(split), leans_left.take(split))
        rest_x = np.where(leans_left, ledge.x + width, ledge.x)
        self._set(new, rest_x.take(split), ledge.y.take(split), rest.take(split))
        self._set(ledge.slot, x, ledge.y + height, width)
        self._join(ledge.slot)
        return x

    def raise_ledges(self, rows: Indices, ledge: Ledge, max_y: Ints) -> None:
        """Give up the room on the ledges of ``rows`` (R,), because nothing fits there.

        Their y grows to the end of the shorter wall, but at most to ``max_y`` (R,), px.
        """
        if not rows.size:
            return
        ledge = ledge.of(rows)
        y = np.minimum(ledge.y + np.minimum(ledge.left, ledge.right), max_y)
        self._set(ledge.slot, ledge.x, y, ledge.width)
        self._join(ledge.slot)

    def _set(self, slot: Indices, x: Ints, y: Ints, width: Ints) -> None:
        self._x[slot], self._y[slot], self._width[slot] = x, y, width
        self._order[slot] = y << 20 | x

    def _split(self, rows: Indices, slot: Indices, after: Flags) -> Indices:
        """Insert a new ledge ``after`` (or before) the one at ``slot``; return its slot."""
        new = self._free.take(rows)
        self._free[rows] = new + 1
        left = np.where(after, slot, self._before.take(slot))
        right = np.where(after, self._after.take(slot), slot)
        self._link(left, new)
        self._link(new, right)
        return new

    def _link(self, left: Indices, right: Indices) -> None:
        self._after[left], self._before[right] = right, left

    def _join(self, slot: Indices) -> None:
        """Merge the ledges at ``slot`` with neighbours of the same y."""
        self._absorb(slot, self._before)
        self._absorb(slot, self._after)

    def _absorb(self, slot: Indices, beside: Indices) -> None:
        level = (self._y.take(beside.take(slot)) == self._y.take(slot)).nonzero()[0]
        if not level.size:
            return
        slot = slot.take(level)
        other = beside.take(slot)
        self._set(
            slot,
            np.minimum(self._x.take(slot), self._x.take(other)),
            self._y.take(slot),
            self._width.take(slot) + self._width.take(other),
        )
        self._order[other] = _UNUSED
        beyond = beside.take(other)
        if beside is self._before:
            self._link(beyond, slot)
        else:
            self._link(slot, beyond)
