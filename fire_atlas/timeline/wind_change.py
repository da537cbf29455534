"""Choose when a fire's loop in one wind is left for that in another, so that no step is seen."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, kept
from fire_atlas.core.fire_in_wind import FireInWind, WindChange, even_progress
from fire_atlas.core.workers import Workers
from fire_atlas.vision.sampling import frame_steps
from fire_atlas.vision.thumbnails import distance, shrunk

CHANGE_TIMES = 0.5, 0.75, 1.0, 1.5, 2.0
"""Durations of a change of wind, seconds. A longer one is tried where a shorter one takes large
steps: calm fire, which hardly moves otherwise, has to lean slowly."""

MAX_STEP = 1.25
"""Largest step of a change that nobody sees, in median steps of its two loops."""

_STEP_TARGET = 1.15
"""Largest step that is looked for, in median steps: flakes will add to it."""

_TRIES = 3
"""Maximum number of frames from which a change of one duration is drawn."""

_PACES = 4
"""Maximum number of paces at which a change is drawn, each after the steps of the one before."""

_SIDE = 64
"""Longest side of the small copies of frames by which those to try are found, px."""


@dataclass(frozen=True, slots=True)
class ChosenChange:
    """A change of wind, and where it is entered and left.

    Attributes:
        before, after: Indices of the loops.
        start: Last frame of ``before`` that is shown.
        change: The frames that follow, and the frame of ``after`` that follows them.
        largest_step: Largest step from frame to frame, from ``start`` to the frame of ``after``, in
            median steps of both loops.
    """

    before: int
    after: int
    start: int
    change: WindChange
    largest_step: float


@dataclass(frozen=True, slots=True)
class MeasuredLoop:
    """A loop, its frames small, and its steps.

    Attributes:
        clip: The loop.
        small: (frames, h, w, 4) small copies.
        steps: (frames,) root mean square difference of each frame from the next.
    """

    clip: Clip
    small: NDArray[np.float32]
    steps: NDArray[np.float64]

    @classmethod
    def of(cls, clip: Clip, workers: Workers) -> "MeasuredLoop":
        """Read all frames of a loop."""
        numbers = range(clip.count)
        small = np.stack(list(workers.map(lambda i: shrunk(clip.read(i), _SIDE), numbers)))
        return cls(clip, small, frame_steps(clip, workers))


def choose_changes(fire: FireInWind, workers: Workers) -> list[ChosenChange]:
    """Return the changes from each wind to the next and back, in this order.

    The frames from which a change may start are ranked by the steps of both loops and their
    distance at the same moments. Then changes are drawn from the best on, each at paces that make
    its steps more equal, until the steps of one are small.
    """
    loops = [MeasuredLoop.of(clip, workers) for clip in fire.loops]
    pairs = [pair for k in range(1, len(loops)) for pair in ((k - 1, k), (k, k - 1))]
    return [_chosen(fire, loops, *pair, workers) for pair in pairs]


def _chosen(
    fire: FireInWind, loops: Sequence[MeasuredLoop], before: int, after: int, workers: Workers
) -> ChosenChange:
    one, other = loops[before], loops[after]
    unit = max(float(np.median(np.concatenate([one.steps, other.steps]))), 1e-12)
    best: ChosenChange | None = None
    counts = _frames_of_changes(one.clip)
    for count in counts:
        is_longest = count == counts[-1]
        pace = even_progress(count)
        changes = [fire.change(before, after, start, pace) for start in range(one.clip.count)]
        expected = [_expected(one, other, i, change) for i, change in enumerate(changes)]
        for start in np.argsort(expected, kind="stable")[:_TRIES].tolist():
            for change, steps in _at_paces(fire, loops, (before, after, start), pace, workers):
                step, mean = float(steps.max()) / unit, float(steps.mean()) / unit
                if best is None or step < best.largest_step:
                    best = ChosenChange(before, after, start, change, step)
                if step <= _STEP_TARGET:
                    return best
                if mean >= (best.largest_step if is_longest else _STEP_TARGET):
                    break  # no other pace makes the mean less, a longer change does
    if best is None:
        raise ValueError("a loop has at least one frame")
    return best


def _at_paces(
    fire: FireInWind,
    loops: Sequence[MeasuredLoop],
    place: tuple[int, int, int],
    progress: NDArray[np.float64],
    workers: Workers,
) -> Iterator[tuple[WindChange, NDArray[np.float64]]]:
    """Yield a change and its steps (frames + 1,), first at the pace of ``progress``, and then each
    time at one that would have made the steps before equal.

    ``place`` is the loop before, the loop after, and the last frame of the one before.
    """
    before, after, start = place
    for _ in range(_PACES):
        change = fire.change(before, after, start, progress)
        change = replace(change, clip=kept(change.clip))
        steps = _steps(loops[before], loops[after], start, change, workers)
        yield change, steps
        progress = _evened(progress, steps)


def _steps(
    one: MeasuredLoop, other: MeasuredLoop, start: int, change: WindChange, workers: Workers
) -> NDArray[np.float64]:
    """Return the steps (frames + 1,) of a change, from the loop before to that after."""
    shown = workers.map(change.clip.read, range(change.clip.count))
    frames = [one.clip.read(start), *shown, other.clip.read(change.entry)]
    return np.array([distance(*pair) for pair in itertools.pairwise(frames)])


def _evened(progress: NDArray[np.float64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the progress (count,) at which a change would have equal steps, if what it does
    between two frames of ``progress``, which are ``steps`` (count + 1,) apart, is done evenly."""
    passed = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.concatenate([[0.0], progress, [1.0]])
    even: NDArray[np.float64] = np.interp(even_progress(len(progress)) * passed[-1], passed, at)
    return even


def _frames_of_changes(loop: Clip) -> list[int]:
    """Return the numbers of frames that a change may have: less than a loop."""
    counts = [min(max(round(time * loop.fps), 4), loop.count - 2) for time in CHANGE_TIMES]
    return sorted({*counts})


def _expected(one: MeasuredLoop, other: MeasuredLoop, start: int, change: WindChange) -> float:
    """Return the largest step to expect: that of the fire in both winds, and at a right angle to it
    that from one fire to the other."""
    count, frames = change.clip.count, one.clip.count
    leaving, entering = change_frames(start, change.entry, count, frames)
    share = np.concatenate([[0.0], change.shares, [1.0]])
    left = np.concatenate([[start], leaving])
    entered = np.concatenate([[(int(entering[0]) - 1) % frames], entering])
    apart = np.array(
        [distance(one.small[i], other.small[k]) for i, k in zip(left, entered, strict=True)]
    )
    weight = (share[1:] + share[:-1]) / 2
    moved = one.steps[left] * (1 - weight) + other.steps[entered] * weight
    return float(np.hypot(moved, np.diff(share) * apart).max())


def change_frames(
    start: int, entry: int, count: int, frames: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the frames of the loops before and after, each (count,), that a change fades between.

    Args:
        start: Last frame of the loop before that is shown.
        entry: First frame of the loop after that is shown.
        count: Frames of the change.
        frames: Frames of each loop.
    """
    passed = np.arange(1, count + 1)
    return (start + passed) % frames, (entry - count - 1 + passed) % frames
