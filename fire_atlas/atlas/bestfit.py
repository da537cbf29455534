"""Fill pages by best-fit: place on the lowest ledge the rectangle that suits it best. A ledge is a
horizontal stretch of the edge of the area already taken.

After Burke, Kendall and Whitwell, "A new placement heuristic for the orthogonal stock-cutting
problem" (2004). A score measures how well a rectangle suits a ledge, as in Leung, Zhang and Sim,
"A two-stage intelligent search algorithm for the two-dimensional strip packing problem" (2011).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.skyline import Flags, Indices, Ints, Ledge, Skyline

Floats = NDArray[np.float32]
Shorts = NDArray[np.int16]

_LONGEST = (1 << 15) - 1
"""Longest length that 16 bits hold, px: twice the largest page's. Numpy is fastest with short
numbers; walls, which may be longer, count as this."""

_TOGETHER = 100_000
"""Number of scores that are computed at a time: as many as a processor's cache holds."""

_COMPACT_EVERY = 16
"""Number of steps after which the columns of rectangles that were placed are dropped."""

# Terms of the score, tuned by trying thousands of values on sets of 300 rectangles that no test
# uses. The rectangle's priority is added: large ones first, and tall ones before wide ones.
# "Near" and "far" are the walls beside the ledge: the one that ends first, and the other one.
_FILLS = 2.3  # takes the ledge's whole width
_LEVEL_WITH_FAR = 4.0  # ends level with the far wall
_LEVEL_WITH_NEAR = 1.1  # ends level with the near wall
_FILLS_TO_FAR = 2.0  # in addition, if it both fills and ends level
_FILLS_TO_NEAR = 1.5
_FILLS_BEYOND = 1.4  # takes the whole width and reaches beyond both walls
_SLIVER = 0.3  # leaves a gap too narrow for anything, so nearly takes the width
_WASTE = 6.5  # subtracted times the area of that gap, in mean areas of a rectangle
_STEP = 0.57  # subtracted times the step from its end to the far wall's, in typical sides
_MAX_STEP = 2.6  # limit on that step, in typical sides
_MISFIT = np.float32(-1e9)  # added where it does not fit
_TALL_FIRST = 0.66  # a priority is ln(height) + this · ln(width)


class Batch(NamedTuple):
    """B pages to fill, and the rectangles to place on each of them, in px.

    Attributes:
        widths, heights: (B, n), the rectangles, none above ``_LONGEST``; x and y may be exchanged
            on some pages.
        owners: (n,): columns with the same owner are one rectangle, upright and rotated.
        page_widths, page_heights: (B,), room on each page.
        priorities: (B, n), added to the score of each rectangle on every ledge, so that those with
            high ones are placed first; -inf is never placed.
    """

    widths: Ints
    heights: Ints
    owners: Ints
    page_widths: Ints
    page_heights: Ints
    priorities: Floats


class Positions(NamedTuple):
    """Top-left corner of each rectangle: (B, n), px; -1 if it was not placed."""

    x: Ints
    y: Ints


def priorities_of(sizes: Ints) -> Floats:
    """Return the priorities (n,) of rectangles of these sizes (n, 2), px."""
    # Not numpy's logarithm, whose last bits depend on the processor.
    priorities = [math.log(high) + _TALL_FIRST * math.log(wide) for wide, high in sizes.tolist()]
    return np.array(priorities, np.float32)


def fill(batch: Batch) -> Positions:
    """Fill each page with as many rectangles as best-fit finds room for."""
    remaining = _Remaining(batch)
    skyline = Skyline(batch.page_widths, batch.widths.shape[1] + 1)
    while True:
        ledge = skyline.lowest()
        room = batch.page_heights - ledge.y
        going = (room > 0) & (remaining.count > 0)
        if not going.any():
            return Positions(remaining.x, remaining.y)
        chosen, fits = remaining.choose(ledge, room)
        rows = (fits & going).nonzero()[0]
        width, height = remaining.size(rows, chosen[rows])
        remaining.take(rows, chosen[rows], skyline.place(rows, ledge, width, height), ledge.y[rows])
        stuck = (~fits & going).nonzero()[0]
        skyline.raise_ledges(stuck, ledge, batch.page_heights[stuck])


class _Remaining:
    """The rectangles not yet placed on each page, and the positions of the others."""

    def __init__(self, batch: Batch) -> None:
        pages, columns = batch.widths.shape
        kinds = len(np.unique(batch.owners))
        self._ids = np.tile(np.arange(columns), (pages, 1))
        self._owners = np.tile(batch.owners, (pages, 1))
        self._widths = batch.widths.astype(np.int16)
        self._heights = batch.heights.astype(np.int16)
        self._priorities = batch.priorities.copy()  # -inf: taken
        self._side = math.sqrt(float(np.mean(batch.widths[0] * batch.heights[0])))
        self._may_rotate = kinds < columns
        self._narrowest, self._age = np.zeros(pages, np.uint16), 0
        self.count = np.isfinite(batch.priorities).sum(axis=1) // (columns // kinds)
        self.x, self.y = (np.full((pages, columns), -1, np.int64) for _ in range(2))

    def size(self, rows: Indices, columns: Indices) -> tuple[Ints, Ints]:
        """Return widths and heights of one rectangle per row, px."""
        widths, heights = self._widths[rows, columns], self._heights[rows, columns]
        return widths.astype(np.int64), heights.astype(np.int64)

    def choose(self, ledge: Ledge, room: Ints) -> tuple[Indices, Flags]:
        """Return the column that suits each page's ledge best, and whether any fits."""
        if self._age % _COMPACT_EVERY == 0:
            self._drop_placed()
        self._age += 1
        pages, columns = self._widths.shape
        best, fits = np.empty(pages, np.intp), np.empty(pages, bool)
        together = max(_TOGETHER // columns, 1)
        for first in range(0, pages, together):
            part = slice(first, first + together)
            scores = self._scores(part, ledge, room)
            best[part] = scores.argmax(axis=1)
            fits[part] = scores.max(axis=1) > _MISFIT / 2
        return best, fits

    def take(self, rows: Indices, columns: Indices, x: Ints, y: Ints) -> None:
        """Record the position of one rectangle of each row."""
        ids = self._ids[rows, columns]
        self.x[rows, ids], self.y[rows, ids] = x, y
        self.count[rows] -= 1
        self._priorities[rows, columns] = -np.inf
        if self._may_rotate:
            same = self._owners[rows] == self._owners[rows, columns][:, None]
            self._priorities[rows] = np.where(same, np.float32(-np.inf), self._priorities[rows])

    def _scores(self, part: slice, ledge: Ledge, room: Ints) -> Floats:
        """Return the score of every rectangle on some of the pages, (pages, columns): ``_MISFIT``
        lower where it does not fit."""
        near, far, wide, high = (
            np.minimum(lengths[part], _LONGEST).astype(np.int16)[:, None]
            for lengths in (
                np.minimum(ledge.left, ledge.right), np.maximum(ledge.left, ledge.right),
                ledge.width, room,
            )
        )  # fmt: skip
        heights, narrowest = self._heights[part], self._narrowest[part, None]
        step, rest = np.abs(heights - far), wide - self._widths[part]
        scores: Floats = step.astype(np.float32)
        np.clip(scores, 0, np.float32(_MAX_STEP * self._side), out=scores)
        scores *= np.float32(-_STEP / self._side)
        scores += self._priorities[part]
        # Few rectangles leave nothing, or too little for any other, or end level with a wall.
        special = rest.view(np.uint16) < narrowest  # below 0 is above all others
        special |= heights == near
        special |= step == 0
        at = special.ravel().nonzero()[0]
        page = at // scores.shape[1]
        walls = near.take(page), far.take(page)
        gaps = rest.take(at), narrowest.take(page)
        scores.put(at, self._with_extras(scores.take(at), heights.take(at), walls, gaps))
        misfits = rest < 0
        misfits |= heights > high
        scores += np.multiply(misfits, _MISFIT)
        return scores

    def _with_extras(
        self,
        score: Floats,
        height: Shorts,
        walls: tuple[Shorts, Shorts],
        gaps: tuple[Shorts, NDArray[np.uint16]],
    ) -> Floats:
        """Return the scores of rectangles with what their ends add. All (n,), px.

        Args:
            score: Without it.
            height: Of each rectangle.
            walls: Length of the wall beside its ledge that ends first, and of the other one.
            gaps: Width of the ledge that each leaves, and of the narrowest one that is not placed.
        """
        (near, far), (gap, narrowest) = walls, gaps
        fills, level_near, level_far = gap == 0, height == near, height == far
        for which, extra in (
            (level_far, _LEVEL_WITH_FAR),
            (level_near, _LEVEL_WITH_NEAR),
            (fills, _FILLS),
            (fills & level_near, _FILLS_TO_NEAR),
            (fills & level_far, _FILLS_TO_FAR),
            (fills & (height > far), _FILLS_BEYOND),
        ):
            score += which * np.float32(extra)
        lost = gap.astype(np.float32) * np.minimum(height, near).astype(np.float32)
        sliver = np.float32(_SLIVER) - lost * np.float32(_WASTE / self._side**2)
        return score + np.where((gap > 0) & (gap < narrowest), sliver, np.float32(0))

    def _drop_placed(self) -> None:
        """Drop columns that were placed, and find the narrowest of the others."""
        taken = np.isneginf(self._priorities)
        columns = max(int((~taken).sum(axis=1).max()), 1)
        if columns < 0.8 * taken.shape[1]:
            keep = np.argsort(taken, axis=1, kind="stable")[:, :columns]
            self._ids = np.take_along_axis(self._ids, keep, axis=1)
            self._owners = np.take_along_axis(self._owners, keep, axis=1)
            self._widths = np.take_along_axis(self._widths, keep, axis=1)
            self._heights = np.take_along_axis(self._heights, keep, axis=1)
            self._priorities = np.take_along_axis(self._priorities, keep, axis=1)
            taken = np.isneginf(self._priorities)
        narrowest = np.where(taken, np.int16(_LONGEST), self._widths).min(axis=1)
        self._narrowest = narrowest.astype(np.uint16)
