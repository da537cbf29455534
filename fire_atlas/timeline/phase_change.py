"""Choose which frames of a loop are shown while a fire is lit and put out, and with how much fuel.

A fire that is lit shows the last frames of its loop, so that the first one follows; one that is put
out goes on with the frames after the last. It may be put out at several frames: what follows the
others passes into what follows the last one.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Pixels
from fire_atlas.recipe.phases import MAX_EXIT
from fire_atlas.vision.thumbnails import distance

MAX_STEP = 1.25
"""Largest step of a change that nobody sees, in the larger median step of what is on both sides."""

_ENTRY_TIMES = 0.15, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0
"""Durations, s, in which what follows another frame passes into what follows the last one: the
shortest without a large step is taken."""

_BURNT = 0.85
"""Part of an extinction after which the flame has gone out: smoke and flakes are left."""

_SPARK = 0.1
"""Fuel of the first flame of a fire that is lit."""

_STEP_TARGET = 1.1
"""Largest step that is looked for, in median steps: flakes will add to it."""


@dataclass(frozen=True, slots=True)
class PhaseFrames:
    """The frames of a fire that is lit, or put out.

    Attributes:
        shown: (n,) which frame of the loop each shows.
        fuel: (n,) how much of its fuel burns, 0..1.
    """

    shown: NDArray[np.intp]
    fuel: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Exit:
    """A frame of a loop after which its fire may be put out.

    Attributes:
        frame: The last frame of the loop that is shown.
        shown: (n,) the frames of the loop that would follow.
        share: (n,) how far each has passed into that of the fire that is put out after the main
            exit, between 0 and 1. That goes on with its frame n.
        largest_step: Largest step of this and into and out of it, in the larger of the median steps
            of what is on both sides.
    """

    frame: int
    shown: NDArray[np.intp]
    share: NDArray[np.float64]
    largest_step: float


def ignition(loop: int, count: int) -> PhaseFrames:
    """Return the frames of a fire that is lit in ``count`` frames, before a loop of ``loop``."""
    shown = np.arange(-count, 0) % loop
    time = np.arange(1, count + 1) / (count + 1)
    return PhaseFrames(shown, _SPARK + (1 - _SPARK) * smooth_step(time))


def extinction(loop: int, count: int) -> PhaseFrames:
    """Return the frames of a fire that goes out in ``count`` frames, after the last one of a loop
    of ``loop``; the last of them is dark."""
    shown = np.arange(count) % loop
    return PhaseFrames(shown, 1 - smooth_step(np.arange(1, count + 1) / (count * _BURNT)))


def exit_frames(loop: int, fps: float, main: int) -> list[int]:
    """Return the frames of a loop of ``loop`` frames after which its fire may be put out, evenly
    spread and at most ``MAX_EXIT`` apart, but for the ``main`` one."""
    count = math.ceil(loop / max(1, math.floor(MAX_EXIT * fps + 1e-9)))
    return sorted((main + k * loop // count) % loop for k in range(1, count))


def choose_exit(
    frame: int,
    loop: Clip,
    dying: Clip,
    fuel: NDArray[np.float64],
    units: tuple[float, float],
    draw: Callable[[int, float], Pixels],
    *,
    is_drawn: bool,
) -> Exit:
    """Return how a fire goes out after a ``frame`` of its loop that ``dying`` does not follow.

    Args:
        frame: The last frame of the loop that is shown.
        loop: The loop.
        dying: The fire that goes out after another frame of the loop.
        fuel: (frames of ``dying``,) how much of its fuel burns, 0..1.
        units: The median steps from frame to frame of ``loop`` and ``dying``.
        draw: ``draw(i, fuel)`` returns frame i of the loop with so much fuel.
        is_drawn: Whether it is drawn in flat colours, which are never mixed: it is cut.
    """
    best: Exit | None = None
    most = dying.count - 1
    for time in _ENTRY_TIMES:
        count = min(max(2, round(time * loop.fps)), most)
        shown = (frame + 1 + np.arange(count)) % loop.count
        share = smooth_step(np.arange(1, count + 1) / (count + 1))
        share = np.rint(share) if is_drawn else share
        passing = [
            mixed(draw(int(shown[k]), float(fuel[k])), dying.read(k), float(share[k]))
            for k in range(count)
        ]
        frames = [loop.read(frame), *passing, dying.read(count)]
        steps = [distance(*pair) for pair in itertools.pairwise(frames)]
        own = float(np.median(steps[1:-1]))
        usual = [max(own, units[0]), *[max(own, *units)] * (count - 1), max(own, units[1])]
        step = float(np.max(np.array(steps) / np.maximum(usual, 1e-12)))
        if best is None or step < best.largest_step:
            best = Exit(frame, shown, share, step)
        if best.largest_step <= _STEP_TARGET or count == most:
            break
    if best is None:
        raise ValueError("a fire that is put out has frames")
    return best


def mixed(one: Pixels, other: Pixels, share: float) -> Pixels:
    """Return a frame that has passed from ``one`` to ``other`` by ``share``, 0..1."""
    return np.asarray(one + (other - one) * np.float32(share), np.float32)
