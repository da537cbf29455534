"""Which frames of an animation are kept: those that stand for the frames left out after them."""

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_ALL_TRIED = 12
"""Of so many frames, all choices are tried."""


class Selection(NamedTuple):
    """Frames to keep.

    Attributes:
        error: The sum of the errors of all frames, each shown as the last one kept up to it.
        kept: Their indices, increasing from 0: an animation begins with its first frame.
    """

    error: float
    kept: tuple[int, ...]


def selections(errors: NDArray[np.float64], most: int, *, is_even: bool) -> list[Selection]:
    """Return choices of frames to keep, the one with the smallest error first.

    Of few frames these are all choices. Otherwise they are, for each number of frames, the best
    choice of all, found by dynamic programming, and every n-th frame. If all must be shown equally
    long (``is_even``), they are as many frames, evenly spread.

    Args:
        errors: (i, j): the error where frame j is shown in place of frame i.
        most: Largest number of frames to keep.
        is_even: Whether all frames have to be shown equally long.
    """
    count = len(errors)
    sums = np.cumsum(np.vstack([np.zeros(count), errors]), axis=0)
    # (j, end): the error of the frames from j up to, not including, ``end``, shown as frame j.
    spans = (sums - sums[np.arange(count), np.arange(count)]).T
    if is_even:
        found = {evenly_spread(number, count) for number in range(1, count + 1)}
    else:
        found = {tuple(range(0, count, step)) for step in range(1, count + 1)}
    if not is_even and count <= _ALL_TRIED:
        found |= {
            (0, *others)
            for number in range(min(count, most))
            for others in combinations(range(1, count), number)
        }
    elif not is_even:
        found |= set(_best_of_each_number(spans, most))
    of_each_number: dict[int, list[tuple[int, ...]]] = {}
    for kept in found:
        of_each_number.setdefault(len(kept), []).append(kept)
    made = list[Selection]()
    for number, choices in of_each_number.items():
        if number <= most:
            first = np.array(choices)
            end = np.hstack([first[:, 1:], np.full((len(first), 1), count)])
            made += map(Selection, spans[first, end].sum(axis=1).tolist(), choices)
    return sorted(made, key=lambda choice: (choice.error, len(choice.kept), choice.kept))


def _best_of_each_number(spans: NDArray[np.float64], most: int) -> Iterator[tuple[int, ...]]:
    """Yield, for each number of frames up to ``most``, those that leave the smallest error."""
    count = len(spans)
    allowed = np.where(np.arange(count)[:, None] < np.arange(count + 1), spans, np.inf)
    best, before = allowed[0], list[NDArray[np.intp]]()
    for _ in range(min(count, most)):
        kept, end = list[int](), count
        for previous in reversed(before):
            end = int(previous[end])
            kept.append(end)
        yield (0, *reversed(kept))
        through = best[:count, None] + allowed
        before.append(np.argmin(through, axis=0))
        best = through.min(axis=0)


def evenly_spread(number: int, count: int) -> tuple[int, ...]:
    """Return so many of ``count`` frames: of those shown in each equal share of the time, the first
    that begins in it."""
    return tuple(-(-i * count // number) for i in range(number))


def holds(kept: tuple[int, ...], count: int) -> tuple[int, ...]:
    """Return for how many of ``count`` frames each frame that is kept is shown."""
    return tuple(end - first for first, end in zip(kept, (*kept[1:], count), strict=True))
