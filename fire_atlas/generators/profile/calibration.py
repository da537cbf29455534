"""Time generated fire: let it change from frame to frame no more than its clip does.

Several parts of a generated fire may change in the same frame, which makes larger steps than the
clip has. So a fire is generated and measured, and its time goes slower where its steps are large.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.generate.generated_fire import (
    GeneratedFire,
    ProfileFireSettings,
)
from fire_atlas.generators.profile.generate.rendering import renderings
from fire_atlas.generators.profile.learn.measure import frame_difference
from fire_atlas.generators.profile.model import Profile

_TIMING_ROUNDS = 8
"""Maximum number of corrections of the frame times: each shows new moments, with other steps."""

_SAME_STEP = 0.05
"""Steps whose logarithms differ by less than this count as equal."""

_MAX_SEAM = 0.15
"""Limit on the difference between the logarithms of a loop's last step and its median step."""

_STEP_TARGET = 0.95
"""Fraction of the largest allowed step that corrections aim at."""

_SLOWING_POWER = 3.0
"""Time is slowed by (step / allowed step) to this power. It exceeds 1 because flicker does not get
smaller with slower time, and because time must run faster elsewhere to make up for it."""


def measure_steps(fire: GeneratedFire, workers: Workers) -> NDArray[np.float64]:
    """Return the difference of each frame of ``fire`` from the next, drawn from the front in the
    clip's own colours and at its scale; in a loop, also of the last from the first."""
    front = fire.profile.front
    front = replace(front, colours=front.learnt_colours)
    fire = replace(fire, profile=replace(fire.profile, front=front))
    [rendering] = renderings(fire, [0.0], 0.0, None)
    steps = []
    first: Pixels | None = None
    previous: Pixels | None = None
    for frame in workers.map(rendering.frame, range(fire.settings.frames)):
        if previous is not None:
            steps.append(frame_difference(previous, frame))
        first, previous = frame if first is None else first, frame
    if fire.settings.loop and first is not None and previous is not None:
        steps.append(frame_difference(previous, first))
    return np.array(steps)


def calibrate(profile: Profile, settings: ProfileFireSettings, workers: Workers) -> GeneratedFire:
    """Generate a fire with frame times without jumps and, in a loop, without a visible seam.

    In wind the fire keeps the wind's pace, and may take steps of any size within the loop.
    """
    fire = GeneratedFire.of(profile, settings)
    if settings.generation.wind.peak > 0:
        return _with_even_seam(fire, workers) if fire.settings.loop else fire
    sequence = fire.planes[0].playback.sequence
    # If frames of the clip are skipped, steps are larger than the clip's. A cartoon with held
    # frames may take steps of any size.
    max_step = profile.front.statistics.step * max(sequence.rate, 1.0)
    if sequence.holds:
        max_step = math.inf
    best, best_excess = fire, math.inf
    for _ in range(_TIMING_ROUNDS):
        steps = measure_steps(fire, workers)
        seam = float(_deviation(steps)[-1]) / _MAX_SEAM if fire.settings.loop else 0.0
        jump = float(steps.max(initial=0.0)) / max_step
        if max(seam, jump) < best_excess:
            best, best_excess = fire, max(seam, jump)
        if best_excess <= 1.0:
            break
        if seam > 1.0:
            times = _times_from_median_step(fire, steps)
        else:
            times = _times_of_small_steps(fire, steps, _STEP_TARGET * max_step)
        fire = replace(fire, frame_times=times)
    return best


def _with_even_seam(fire: GeneratedFire, workers: Workers) -> GeneratedFire:
    """Return a looping ``fire`` that begins after a step of about median size."""
    steps = measure_steps(fire, workers)
    if float(_deviation(steps)[-1]) <= _MAX_SEAM:
        return fire
    return replace(fire, frame_times=_times_from_median_step(fire, steps))


def _deviation(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the absolute logarithm of each step divided by the median step."""
    size = np.maximum(steps, 1e-9)
    return np.asarray(np.abs(np.log(size / np.median(size))))


def _times_from_median_step(fire: GeneratedFire, steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the frame times of a loop that begins after a step of about median size, as near as
    possible to its present beginning, because the wind does not move with it."""
    number = len(steps)
    shift = np.arange(number)
    distance = np.minimum(shift, number - shift) / number
    start = int(np.argmin(np.maximum(np.roll(_deviation(steps), 1), _SAME_STEP) + distance))
    return np.append(fire.frame_times[start:], fire.frame_times[:start] + fire.period)


def _times_of_small_steps(
    fire: GeneratedFire, steps: NDArray[np.float64], max_step: float
) -> NDArray[np.float64]:
    """Return frame times between which ``fire`` changes by ``max_step`` at most."""
    times = fire.frame_times
    if fire.settings.loop:
        times = np.append(times, times[0] + fire.period)
    # Steps can be evened out, but their mean stays.
    slowing = np.maximum(steps / max(max_step, float(steps.mean())), 1.0) ** _SLOWING_POWER
    slowed_times = np.append(0.0, np.cumsum(slowing))
    slowed_times *= len(steps) / slowed_times[-1]
    return np.asarray(np.interp(np.arange(fire.settings.frames), slowed_times, times))
