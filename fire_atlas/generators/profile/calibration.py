"""Time generated fire: let it change from frame to frame no more than its clip does.

Several parts of a generated fire may change in the same frame, which makes larger steps than the
clip has. So a fire is drawn and measured, and its time goes slower where its steps are large.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import CACHE_BYTES
from fire_atlas.core.picture import CroppedPicture, Picture
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.generate.generated_fire import (
    GeneratedFire,
    ProfileFireSettings,
)
from fire_atlas.generators.profile.generate.rendering import ProfileRendering, renderings
from fire_atlas.generators.profile.learn.measure import frame_difference
from fire_atlas.generators.profile.model import Profile

_TIMING_ROUNDS = 8
"""Maximum number of fires that are measured: each correction of the frame times shows new moments,
with other steps."""

_SAME_STEP = 0.05
"""Steps whose logarithms differ by less than this count as equal."""

_MAX_SEAM = 0.15
"""Limit on the difference between the logarithms of a loop's last step and its median step."""

_STEP_TARGET = 0.95
"""Fraction of the largest allowed step that corrections aim at."""

_SLOWING_POWER = 3.0
"""Time is slowed by (step / allowed step) to this power. It exceeds 1 because flicker does not get
smaller with slower time, and because time must run faster elsewhere to make up for it."""


@dataclass(frozen=True, slots=True)
class DrawnFire:
    """A fire that was drawn to be measured.

    Attributes:
        rendering: The fire from the front, in the clip's own colours and at its scale.
        steps: (frames,) difference of each frame from the next; in a loop, the last is that from
            the last frame to the first, which others lack.
        frames: Frames by their numbers, as many as ``CACHE_BYTES`` hold.
    """

    rendering: ProfileRendering
    steps: NDArray[np.float64]
    frames: dict[int, CroppedPicture]

    @classmethod
    def of(cls, rendering: ProfileRendering, workers: Workers) -> "DrawnFire":
        """Draw and measure all frames of a rendering."""
        settings = rendering.fire.settings
        steps, frames, room = list[float](), dict[int, CroppedPicture](), CACHE_BYTES
        first = previous = np.zeros((0, 0, 4), np.float32)
        for i, frame in enumerate(workers.map(rendering.frame, range(settings.frames))):
            if i > 0:
                steps.append(frame_difference(previous, frame))
            first, previous = first if i > 0 else frame, frame
            cropped = CroppedPicture.of(frame)
            if cropped.part.nbytes <= room:
                room -= cropped.part.nbytes
                frames[i] = cropped
        if settings.loop:
            steps.append(frame_difference(previous, first))
        return cls(rendering, np.array(steps), frames)

    @property
    def fire(self) -> GeneratedFire:
        """The fire."""
        return self.rendering.fire

    @property
    def seam(self) -> float:
        """How far a loop's last step is from the median step; above 1 it is seen."""
        return float(_deviation(self.steps)[-1]) / _MAX_SEAM if self.fire.settings.loop else 0.0

    def with_small_seam(self) -> "DrawnFire":
        """Return a loop that begins after a step of about median size, as near as possible to its
        present beginning, because the wind does not move with it. It shows the same frames."""
        times, number = self.fire.frame_times, len(self.steps)
        shift = np.arange(number)
        distance = np.minimum(shift, number - shift) / number
        begins_after = np.roll(_deviation(self.steps), 1)
        start = int(np.argmin(np.maximum(begins_after, _SAME_STEP) + distance))
        times = np.append(times[start:], times[:start] + self.fire.period)
        return DrawnFire(
            self.rendering.showing(replace(self.fire, frame_times=times)),
            np.roll(self.steps, -start),
            {(i - start) % number: frame for i, frame in self.frames.items()},
        )

    def with_small_steps(self, max_step: float, workers: Workers) -> "DrawnFire":
        """Return the fire with frame times between which it would change by ``max_step`` at most
        if it changed evenly between those it has."""
        times, steps = self.fire.frame_times, self.steps
        if self.fire.settings.loop:
            times = np.append(times, times[0] + self.fire.period)
        # Steps can be evened out, but their mean stays.
        slowing = np.maximum(steps / max(max_step, float(steps.mean())), 1.0) ** _SLOWING_POWER
        slowed_times = np.append(0.0, np.cumsum(slowing))
        slowed_times *= len(steps) / slowed_times[-1]
        times = np.interp(np.arange(self.fire.settings.frames), slowed_times, times)
        fire = replace(self.fire, frame_times=times)
        return DrawnFire.of(self.rendering.showing(fire), workers)


@dataclass(frozen=True, slots=True)
class TimedFire:
    """A fire whose frames have their times.

    Attributes:
        fire: The fire.
        drawn: The same, if it had to be drawn to find them.
    """

    fire: GeneratedFire
    drawn: DrawnFire | None

    def picture(self, view: ProfileRendering) -> Callable[[int], Picture]:
        """Return the function that draws a frame of the fire by its number, as ``view`` shows it.

        A frame that was drawn like that before is handed out and forgotten: clips keep what they
        have read.
        """
        front = self.fire.profile.front
        if (
            self.drawn is None
            or view.camera != self.drawn.rendering.camera
            or front.colours is not front.learnt_colours
        ):
            return view.frame
        frames = self.drawn.frames

        def frame(i: int) -> Picture:
            known = frames.pop(i, None)
            return view.frame(i) if known is None else known.whole(copy=False)

        return frame


def calibrate(profile: Profile, settings: ProfileFireSettings, workers: Workers) -> TimedFire:
    """Generate a fire with frame times without jumps and, in a loop, without a visible seam.

    In wind the fire keeps the wind's pace, and may take steps of any size within the loop.
    """
    fire = GeneratedFire.of(profile, settings)
    is_windy = settings.generation.wind.peak > 0
    if is_windy and not fire.settings.loop:
        return TimedFire(fire, None)
    drawn = best = DrawnFire.of(seen_as_learnt(fire), workers)
    if is_windy:
        best = drawn.with_small_seam() if drawn.seam > 1 else drawn
        return TimedFire(best.fire, best)
    sequence = fire.planes[0].playback.sequence
    # If frames of the clip are skipped, steps are larger than the clip's. A cartoon with held
    # frames may take steps of any size.
    max_step = profile.front.statistics.step * max(sequence.rate, 1.0)
    if sequence.holds:
        max_step = math.inf

    def excess(drawn: DrawnFire) -> float:
        return max(drawn.seam, float(drawn.steps.max(initial=0.0)) / max_step)

    for _ in range(_TIMING_ROUNDS - 1):
        if excess(best) <= 1:
            break
        if drawn.seam > 1:
            drawn = drawn.with_small_seam()
        else:
            drawn = drawn.with_small_steps(_STEP_TARGET * max_step, workers)
        best = min(best, drawn, key=excess)
    return TimedFire(best.fire, best)


def seen_as_learnt(fire: GeneratedFire) -> ProfileRendering:
    """Return a fire from the front, in the clip's own colours and at its scale."""
    front = replace(fire.profile.front, colours=fire.profile.front.learnt_colours)
    as_learnt = replace(fire, profile=replace(fire.profile, front=front))
    [rendering] = renderings(as_learnt, [0.0], 0.0, None)
    return rendering.showing(fire)


def _deviation(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the absolute logarithm of each step divided by the median step."""
    size = np.maximum(steps, 1e-9)
    return np.asarray(np.abs(np.log(size / np.median(size))))
