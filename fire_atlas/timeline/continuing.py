"""Extend a fire beyond its clip: a walk over its frames that jumps between similar ones (Schödl et
al., "Video Textures", SIGGRAPH 2000, sections 3 and 4).

Each jump is a transition: over the frames of the overlap, the stretch of the clip that ends is
blended into the one that begins (see ``edit_list.Transition``).

A beam search finds the cheapest walk of exactly the wanted length. Repeating a transition, or going
back to frames that were just shown, costs extra.
"""

from collections import defaultdict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.timeline.cutting import CutAnalysis
from fire_atlas.timeline.edit_list import Transition

_MAX_TRANSITIONS = 60
"""Maximum number of transitions, the cheapest ones, that walks are made of."""

_SAME_WITHIN = 3
"""Transitions whose frames differ by at most this many look the same."""

_STARTS = 4
"""Number of start frames tried for a loop."""

_BEAM_WIDTH = 8
"""Number of walks of each length that are kept."""

_REPEAT_COST = 1.5
"""Extra cost of each repetition of a transition, in median costs of a transition."""

_BACKTRACK_COST = 1.0
"""Extra cost of going back to frames that were just shown, in the same unit."""

_Candidates = list[tuple[float, Transition]]
"""Transitions that a walk may make, each with its cost."""


class _PartialWalk(NamedTuple):
    """The beginning of a walk.

    Attributes:
        cost: Cost of its transitions.
        next_frame: The frame to show next, the first one after the last transition.
        transitions: The transitions it has made, in order.
    """

    cost: float
    next_frame: int
    transitions: tuple[Transition, ...]


def extend_loop(analysis: CutAnalysis, frames: int) -> list[Transition] | None:
    """Return the transitions of a loop of ``frames`` frames, if any; the last closes the loop."""
    costs, overlap = analysis.costs(), analysis.overlap
    candidates = _best_transitions(costs, analysis)
    found: list[tuple[float, tuple[Transition, ...]]] = []
    beginnings = dict.fromkeys(transition.beginning for _, transition in candidates)
    for beginning in list(beginnings)[:_STARTS]:
        start = _wrapped(beginning + overlap, analysis)
        for length, walks in _walks(candidates, analysis, start, frames - overlap).items():
            for walk in walks:
                ending = walk.next_frame + frames - overlap - length
                if not _can_play(analysis, walk.next_frame, ending):
                    continue
                last = Transition(_wrapped(ending, analysis), beginning)
                cost = costs[last] + _extra_cost(last, walk, analysis, _median_cost(candidates))
                if np.isfinite(cost):
                    found.append((walk.cost + float(cost), (*walk.transitions, last)))
    return list(min(found)[1]) if found else None


def extend_once(analysis: CutAnalysis, frames: int) -> list[Transition] | None:
    """Return the transitions of a walk of ``frames`` frames from the first one on, if any."""
    candidates = _best_transitions(analysis.costs(), analysis)
    found = [
        (walk.cost, walk.transitions)
        for length, walks in _walks(candidates, analysis, 0, frames).items()
        for walk in walks
        if walk.transitions and walk.next_frame + frames - length <= analysis.count
    ]
    return list(min(found)[1]) if found else None


def _walks(
    candidates: _Candidates, analysis: CutAnalysis, start: int, frames: int
) -> dict[int, list[_PartialWalk]]:
    """Return the best partial walks from frame ``start`` by length, all below ``frames`` frames."""
    median, overlap = _median_cost(candidates), analysis.overlap
    walks: dict[int, list[_PartialWalk]] = defaultdict(list, {0: [_PartialWalk(0.0, start, ())]})
    for length in range(frames):
        walks[length] = _beam(walks[length])
        for walk in walks[length]:
            for cost, transition in candidates:
                played = _frames_until(analysis, walk.next_frame, transition.ending)
                new_length = length + played + overlap
                if played < _shortest_stretch(analysis) or new_length >= frames:
                    continue
                cost += _extra_cost(transition, walk, analysis, median)
                following = _wrapped(transition.beginning + overlap, analysis)
                made = (*walk.transitions, transition)
                walks[new_length].append(_PartialWalk(walk.cost + cost, following, made))
    return walks


def _beam(walks: list[_PartialWalk]) -> list[_PartialWalk]:
    """Return the cheapest walks, only one for each last transition."""
    best: dict[tuple[Transition, ...], _PartialWalk] = {}
    for walk in sorted(walks):
        best.setdefault(walk.transitions[-1:], walk)
        if len(best) == _BEAM_WIDTH:
            break
    return list(best.values())


def _best_transitions(costs: NDArray[np.float64], analysis: CutAnalysis) -> _Candidates:
    """Return the cheapest transitions that jump far enough, without near duplicates."""
    count = len(costs)
    ending, beginning = np.indices(costs.shape)
    jump = np.abs(beginning - ending)
    if analysis.closed:
        jump = np.minimum(jump, count - jump)
    remaining = np.where(jump > _min_jump(analysis), costs, np.inf)
    found: _Candidates = []
    while len(found) < _MAX_TRANSITIONS:
        at = int(np.argmin(remaining))
        transition = Transition(at // count, at % count)
        if not np.isfinite(remaining[transition]):
            break
        found.append((float(costs[transition]), transition))
        near = [np.arange(place - _SAME_WITHIN, place + _SAME_WITHIN + 1) for place in transition]
        near = [n % count if analysis.closed else np.clip(n, 0, count - 1) for n in near]
        remaining[np.ix_(*near)] = np.inf
    return found


def _extra_cost(
    transition: Transition, walk: _PartialWalk, analysis: CutAnalysis, median: float
) -> float:
    """Return the extra cost of a transition that repeats another or goes back in its walk."""
    repeats = sum(
        all(abs(a - b) <= _SAME_WITHIN for a, b in zip(transition, other, strict=True))
        for other in walk.transitions
    )
    back = _frames_until(analysis, transition.beginning, transition.ending)
    nearness = max(0.0, 1 - 2 * back / analysis.count) if back > 0 else 0.0
    return median * (_REPEAT_COST * repeats + _BACKTRACK_COST * nearness)


def _median_cost(candidates: _Candidates) -> float:
    return float(np.median([cost for cost, _ in candidates])) if candidates else 1.0


def _min_jump(analysis: CutAnalysis) -> int:
    """Return how many frames a transition must jump over: jumping fewer looks like a stutter."""
    return min(analysis.overlap + 1, analysis.count // 4)


def _shortest_stretch(analysis: CutAnalysis) -> int:
    """Return the minimum number of frames played between two transitions."""
    return max(1, min(analysis.overlap, analysis.count // 6))


def _can_play(analysis: CutAnalysis, first: int, end: int) -> bool:
    """Whether the clip can play from ``first`` up to (not including) ``end`` without a jump, and
    then make a transition. A looping clip continues at its start, but plays no frame twice."""
    # In a clip that does not loop, the frames of the transition must follow ``end``.
    last_end = first + analysis.count - 1 if analysis.closed else analysis.longest
    return first + _shortest_stretch(analysis) <= end <= last_end


def _frames_until(analysis: CutAnalysis, first: int, end: int) -> int:
    """Return the number of frames from ``first`` up to (not including) ``end``.

    A looping clip continues at its start; else it is negative if ``end`` lies before ``first``.
    """
    return (end - first) % analysis.count if analysis.closed else end - first


def _wrapped(frame: int, analysis: CutAnalysis) -> int:
    """Return the number of a frame, counted on from 0 past the end of a looping clip."""
    return frame % analysis.count if analysis.closed else frame
