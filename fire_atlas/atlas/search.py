"""Search for the smallest page: best-fit over many page shapes, then variations of the best ones.

A search ends after a number of pages, never by a clock, and its random numbers do not depend on the
recipe: the same sizes are packed the same everywhere. Rectangles are put on ledges, horizontal
stretches of the edge of the area already taken (see ``skyline``).
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from fire_atlas.atlas.bestfit import Batch, Floats, fill, priorities_of
from fire_atlas.atlas.page_rules import PageRules, Size, effective_area
from fire_atlas.atlas.skyline import Ints
from fire_atlas.core.chance import RandomStream, generator

_BATCH_RECTANGLES = 30_000
"""Number of rectangles placed in one round, over all its pages. With few rectangles, trying many
page shapes helps most; with many, more rounds of varying the best pages do."""

_SMALLEST_BATCH, _LARGEST_BATCH = 96, 288
"""Minimum and maximum number of pages tried in one round."""

_EFFORT = 300_000
"""Maximum number of rectangles placed in a search, over all the pages it tries."""

_EFFORT_OF_MANY = 72_000
"""The same if one page cannot hold all rectangles."""

_NARROWEST, _WIDEST = 0.6, 1.7
"""Page widths that are tried, in sides of the square with the area of all rectangles."""

_KEPT, _PARENTS = 16, 8
"""Number of trials kept after each round, and of those that are varied in the next."""

_NOISE = 0.02
"""Standard deviation of a variation's priorities from those of its parent."""

_NEAR = 1.0005
"""A page at most this many times as large as the smallest is as good, and better if squarer."""

_PROBES = 16
"""Number of counts n for which ``Search.leading`` tries the first n rectangles at a time."""


class Placement(NamedTuple):
    """The number of a rectangle and the place of its top-left corner on its page, px.

    If ``rotated``, it is turned by 90°: its height lies along x and its width along y.
    """

    number: int
    x: int
    y: int
    rotated: bool


class Candidate(NamedTuple):
    """A way to fill a page.

    Attributes:
        width: Room for rectangles along x.
        transposed: Whether x and y are exchanged, so that the page is filled from the left.
        priorities: (n,), added to the score of each rectangle on every ledge, so that those with
            high ones are placed first; -inf is never placed.
    """

    width: int
    transposed: bool
    priorities: Floats


class FilledPage(NamedTuple):
    """The best page that a search found.

    Attributes:
        unplaced_area: Area of the rectangles that were not placed.
        size: Width and height of the page.
        placements: The rectangles that were placed.
    """

    unplaced_area: int
    size: Size
    placements: tuple[Placement, ...]


class Trial(NamedTuple):
    """A page that was tried.

    Attributes:
        unplaced_area: Area of the rectangles that were not placed.
        area: ``effective_area`` of the page.
        used: Area of the bounding box of the rectangles.
        size: Width and height of the page.
        candidate: The way it was filled.
        x, y: Place of each rectangle, px, upright ones first, then rotated ones; x is -1 if it was
            not placed.
    """

    unplaced_area: int
    area: float
    used: int
    size: Size
    candidate: Candidate
    x: Ints
    y: Ints


class Search:
    """A search for the best page for some rectangles."""

    def __init__(self, sizes: Sequence[Size], rules: PageRules) -> None:
        """``sizes`` are (width, height) with padding at the right and the bottom."""
        self._rules = rules
        self._limit = rules.room(rules.largest)
        # Sorted, so that the order in which sizes are given does not matter.
        self._numbers = sorted(range(len(sizes)), key=lambda i: (-sizes[i][1], -sizes[i][0], i))
        upright = np.array([sizes[i] for i in self._numbers], np.int64)
        self._sizes = np.concatenate([upright, upright[:, ::-1]]) if rules.rotate else upright
        self._areas = self._sizes.prod(axis=1)
        self._widest = tuple(self._sizes.max(axis=0).tolist())
        self._area = int(self._areas[: len(upright)].sum())
        self._upright_priorities = priorities_of(self._sizes)
        self._transposed_priorities = priorities_of(self._sizes[:, ::-1])

    def best(self, tries: int) -> FilledPage:
        """Return the smallest of ``tries`` pages that holds all rectangles or, if none does, the
        fullest. Fewer are tried if there are very many rectangles."""
        effort = _EFFORT if self._area <= self._limit**2 else _EFFORT_OF_MANY
        count = len(self._sizes)
        tries = min(tries, max(effort // count, 16))
        together = min(tries, max(_SMALLEST_BATCH, min(_BATCH_RECTANGLES // count, _LARGEST_BATCH)))
        trials = self._sorted(self._try(self._shapes(together)))
        for generation in range(1, tries // together):
            if trials[0].used == self._area:
                break  # nothing is empty
            varied = self._variations(trials[:_PARENTS], together, generation)
            trials = self._sorted(trials + self._try(varied))
        chosen = self._squarest(trials)
        return FilledPage(chosen.unplaced_area, chosen.size, tuple(self._placements(chosen)))

    def leading(self) -> int:
        """Return how many rectangles, from the first on, surely fit on one page together."""
        fits, limit = 1, len(self._numbers)
        while fits < limit:
            counts = np.unique(np.linspace(fits + 1, limit, _PROBES, dtype=int)).tolist()
            trials = self._try([self._first_only(count) for count in counts])
            fitted = [
                np.count_nonzero(trial.x >= 0) == n for trial, n in zip(trials, counts, strict=True)
            ]
            first_failure = fitted.index(False) if False in fitted else len(counts)
            limit = counts[first_failure] - 1 if first_failure < len(counts) else limit
            fits = counts[first_failure - 1] if first_failure else fits
        return fits

    def _first_only(self, count: int) -> Candidate:
        later = np.tile(np.array(self._numbers) >= count, len(self._sizes) // len(self._numbers))
        priorities = np.where(later, np.float32(-np.inf), self._upright_priorities)
        return Candidate(self._limit, False, priorities)

    def _shapes(self, count: int) -> list[Candidate]:
        """Return ``count`` candidates of many page shapes; noise varies those of the same shape."""
        low, high = (0.99, 1.2) if self._rules.square else (_NARROWEST, _WIDEST)
        noise = _noise((count, len(self._sizes)), 0)
        candidates: dict[tuple[int, bool], Candidate] = {}
        repeated = []
        for i, shape in enumerate(np.repeat(np.linspace(low, high, -(-count // 2)), 2)[:count]):
            transposed = bool(i % 2)
            width = self._width(round(shape * math.sqrt(self._area)), transposed)
            candidate = Candidate(
                width,
                transposed,
                self._transposed_priorities if transposed else self._upright_priorities,
            )
            if candidates.setdefault((width, transposed), candidate) is not candidate:
                repeated.append(candidate._replace(priorities=candidate.priorities + noise[i]))
        return [*candidates.values(), *repeated]

    def _variations(self, parents: list[Trial], count: int, generation: int) -> list[Candidate]:
        """Return candidates like those of ``parents``, with varied priorities and widths."""
        noise = _noise((count, len(self._sizes)), generation)
        return [
            Candidate(
                self._width(parent.width + (i // _PARENTS) % 9 - 4, parent.transposed),
                parent.transposed,
                parent.priorities + noise[i],
            )
            for i in range(count)
            for parent in [parents[i % len(parents)].candidate]
        ]

    def _width(self, room: int, transposed: bool) -> int:
        """Return the room of the page nearest to ``room`` that is wide enough for any rectangle."""
        widest = self._widest[transposed]
        side = self._rules.page(max(room, widest), 1)[0]
        return self._rules.room(min(side, self._rules.largest))

    def _try(self, candidates: list[Candidate]) -> list[Trial]:
        transposed = np.array([candidate.transposed for candidate in candidates])[:, None]
        width, height = self._sizes.T
        filled = fill(
            Batch(
                widths=np.where(transposed, height, width),
                heights=np.where(transposed, width, height),
                owners=np.arange(len(self._sizes)) % len(self._numbers),
                page_widths=np.array([candidate.width for candidate in candidates]),
                page_heights=np.full(len(candidates), self._limit),
                priorities=np.stack([candidate.priorities for candidate in candidates]),
            )
        )
        x, y = np.where(transposed, filled.y, filled.x), np.where(transposed, filled.x, filled.y)
        is_placed = x >= 0
        used_width = np.where(is_placed, x + width, 1).max(axis=1).tolist()
        used_height = np.where(is_placed, y + height, 1).max(axis=1).tolist()
        unplaced = (self._area - np.where(is_placed, self._areas, 0).sum(axis=1)).tolist()
        return [
            Trial(left, effective_area(size), across * down, size, candidate, *at)
            for candidate, left, across, down, *at in zip(
                candidates, unplaced, used_width, used_height, x, y, strict=True
            )
            for size in [self._rules.page(across, down)]
        ]

    def _sorted(self, trials: list[Trial]) -> list[Trial]:
        """Return the best trials: least unplaced, then smallest page, then smallest used part."""
        return sorted(trials, key=lambda t: (t.unplaced_area, t.area, t.used, max(t.size)))[:_KEPT]

    def _placements(self, trial: Trial) -> Iterator[Placement]:
        count, border = len(self._numbers), self._rules.border
        for i in np.flatnonzero(trial.x >= 0).tolist():
            x, y = int(trial.x[i]) + border, int(trial.y[i]) + border
            yield Placement(self._numbers[i % count], x, y, i >= count)

    def _squarest(self, trials: list[Trial]) -> Trial:
        best = trials[0]
        equal = [t for t in trials if t.unplaced_area == best.unplaced_area]
        near = [t for t in equal if t.area <= _NEAR * best.area]
        return min(near, key=lambda trial: max(trial.size))


def _noise(shape: tuple[int, int], generation: int) -> Floats:
    chance = generator(0, RandomStream.PACKING, generation)
    return chance.standard_normal(shape, np.float32) * np.float32(_NOISE)
