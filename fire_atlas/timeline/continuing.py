"""Fire that goes on longer than its clip: from moment to moment that look alike (Schödl et al.,
"Video Textures", SIGGRAPH 2000, sections 3 and 4).

A walk over the clip is searched for that lasts exactly so many frames, joins what looks alike, and
neither makes the same join again soon nor goes back to what was just seen.
"""

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.timeline.cutting import Footage
from fire_atlas.timeline.takes import Join

_JOINS = 60
"""Best joins that a walk is made of."""

_APART = 3
"""Frames by which joins differ that are not the same to the eye."""

_STARTS = 4
"""Places tried for a loop to begin at."""

_WIDTH = 8
"""Walks that are kept of every length."""

_AGAIN = 1.5
"""What making a join again costs, in the cost of a usual join."""

_BACK = 1.0
"""What going back to what was just seen costs, in the same."""


class _Walk(NamedTuple):
    """The beginning of a walk: what it costs, where it stands, and its joins so far."""

    cost: float
    at: int
    joins: tuple[Join, ...]


def continued_loop(footage: Footage, frames: int) -> list[Join] | None:
    """Return the joins of a loop of ``frames``, the last leading back to its start; None if there
    is none."""
    costs, overlap = footage.costs(), footage.overlap
    choice = _best_joins(costs, footage)
    found: list[tuple[float, tuple[Join, ...]]] = []
    for beginning in list(dict.fromkeys(join.beginning for _, join in choice))[:_STARTS]:
        start = _wrap(beginning + overlap, footage)
        for length, walks in _walks(choice, footage, start, frames - overlap).items():
            for walk in walks:
                ending = walk.at + frames - overlap - length
                if not _may_run(footage, walk.at, ending):
                    continue
                last = Join(_wrap(ending, footage), beginning)
                price = costs[last] + _price(last, walk.joins, footage, _usual(choice))
                if np.isfinite(price):
                    found.append((walk.cost + float(price), (*walk.joins, last)))
    return list(min(found)[1]) if found else None


def continued_once(footage: Footage, frames: int) -> list[Join] | None:
    """Return the joins of a walk of ``frames`` from the first frame on; None if there is none."""
    choice = _best_joins(footage.costs(), footage)
    found = [
        (walk.cost, walk.joins)
        for length, walks in _walks(choice, footage, 0, frames).items()
        for walk in walks
        if walk.joins and walk.at + frames - length <= footage.count
    ]
    return list(min(found)[1]) if found else None


def _walks(
    choice: Sequence[tuple[float, Join]], footage: Footage, start: int, frames: int
) -> dict[int, list[_Walk]]:
    """Best beginnings of walks from frame ``start``, by their length, up to ``frames``."""
    usual, overlap = _usual(choice), footage.overlap
    walks: dict[int, list[_Walk]] = defaultdict(list, {0: [_Walk(0.0, start, ())]})
    for length in range(frames):
        walks[length] = _distinct(walks[length])
        for walk in walks[length]:
            for cost, join in choice:
                run = _run(footage, walk.at, join.ending)
                then = length + run + overlap
                if run < _shortest_run(footage) or then >= frames:
                    continue
                price = cost + _price(join, walk.joins, footage, usual)
                landed = _wrap(join.beginning + overlap, footage)
                walks[then].append(_Walk(walk.cost + price, landed, (*walk.joins, join)))
    return walks


def _distinct(walks: list[_Walk]) -> list[_Walk]:
    """The cheapest walks; of those that end with the same join only one."""
    best: dict[tuple[Join, ...], _Walk] = {}
    for walk in sorted(walks):
        best.setdefault(walk.joins[-1:], walk)
        if len(best) == _WIDTH:
            break
    return list(best.values())


def _best_joins(costs: NDArray[np.float64], footage: Footage) -> list[tuple[float, Join]]:
    """The cheapest joins that lead well away, none of them next to a cheaper one."""
    count = len(costs)
    ending, beginning = np.indices(costs.shape)
    leap = np.abs(beginning - ending)
    if footage.closed:
        leap = np.minimum(leap, count - leap)
    left = np.where(leap > _least_leap(footage), costs, np.inf)
    found: list[tuple[float, Join]] = []
    while len(found) < _JOINS:
        at = int(np.argmin(left))
        join = Join(at // count, at % count)
        if not np.isfinite(left[join]):
            break
        found.append((float(costs[join]), join))
        near = [np.arange(place - _APART, place + _APART + 1) for place in join]
        near = [n % count if footage.closed else np.clip(n, 0, count - 1) for n in near]
        left[np.ix_(*near)] = np.inf
    return found


def _price(join: Join, before: Sequence[Join], footage: Footage, usual: float) -> float:
    """What is added to the cost of a join because of what the walk has shown before."""
    again = sum(all(abs(a - b) <= _APART for a, b in zip(join, other, strict=True))
                for other in before)  # fmt: skip
    back = _run(footage, join.beginning, join.ending)
    near = max(0.0, 1 - 2 * back / footage.count) if back > 0 else 0.0
    return usual * (_AGAIN * again + _BACK * near)


def _usual(choice: Sequence[tuple[float, Join]]) -> float:
    return float(np.median([cost for cost, _ in choice])) if choice else 1.0


def _least_leap(footage: Footage) -> int:
    """A join that leads less far is a stutter."""
    return min(footage.overlap + 1, footage.count // 4)


def _shortest_run(footage: Footage) -> int:
    """Fewest frames of a take that are seen alone."""
    return max(1, min(footage.overlap, footage.count // 6))


def _may_run(footage: Footage, first: int, end: int) -> bool:
    """Whether a take may be seen alone from ``first`` until ``end``, counted on past the end."""
    last = first + footage.count - 1 if footage.closed else footage.longest
    return first + _shortest_run(footage) <= end <= last


def _run(footage: Footage, first: int, end: int) -> int:
    """Frames from ``first`` until ``end``; round the end of a clip that closes."""
    return (end - first) % footage.count if footage.closed else end - first


def _wrap(frame: int, footage: Footage) -> int:
    return frame % footage.count if footage.closed else frame
