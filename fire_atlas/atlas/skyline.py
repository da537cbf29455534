"""The skylines of many pages at once: the lower edge of the area taken on each page.

All pages of a batch are filled in step, so that numpy does the work. The ledges of a page are a
doubly linked list in arrays, one row per page; a slot is never reused.
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
        slot: Its index in the arrays.
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
        return Ledge(*(field[rows] for field in self))


class Skyline:
    """The skylines of B pages."""

    def __init__(self, widths: Ints, max_ledges: int) -> None:
        """Start with empty pages of these ``widths`` (B,), px; each may create ``max_ledges``."""
        shape = len(widths), max_ledges + 2
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
        """Return the ledge with the least y of each page."""
        rows, slot = self._rows, self._order.argmin(axis=1)
        y = self._y[rows, slot]
        left = self._y[rows, self._before[rows, slot]] - y
        right = self._y[rows, self._after[rows, slot]] - y
        return Ledge(slot, self._x[rows, slot], y, self._width[rows, slot], left, right)

    def place(self, rows: Indices, ledge: Ledge, width: Ints, height: Ints) -> Ints:
        """Place a rectangle on the ledge of each of ``rows`` (R,); return its x, px.

        It is put against the longer wall, or against the one it ends level with. The page's left
        edge counts as the longest wall, so that the page can end at its last column.
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

    def raise_ledges(self, rows: Indices, ledge: Ledge, max_y: Ints) -> None:
        """Give up the room on the ledges of ``rows`` (R,), because nothing fits there.

        Their y grows to the end of the shorter wall, but at most to ``max_y`` (R,), px.
        """
        ledge = ledge.of(rows)
        y = np.minimum(ledge.y + np.minimum(ledge.left, ledge.right), max_y)
        self._set(rows, ledge.slot, ledge.x, y, ledge.width)
        self._join(rows, ledge.slot)

    def _set(self, rows: Indices, slot: Indices, x: Ints, y: Ints, width: Ints) -> None:
        self._x[rows, slot], self._y[rows, slot], self._width[rows, slot] = x, y, width
        self._order[rows, slot] = y << 20 | x

    def _split(self, rows: Indices, slot: Indices, after: Flags) -> Indices:
        """Insert a new ledge ``after`` (or before) the one at ``slot``; return its slot."""
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
        """Merge the ledges at ``slot`` with neighbours of the same y."""
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
