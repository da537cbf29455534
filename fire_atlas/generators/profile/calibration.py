"""Correct what is generated until it measures as its clip does, before anybody sees it.

How far the tip of a flame leans depends on which of its tongues is the tallest, and parts of
different moments side by side do not agree on that as the tongues of one moment do. And in the clip
neighbouring frames differ by some amount at most, whereas in generated fire several parts may
change at once. So a fire is generated, measured as the clip was, and corrected: once for the
profile, as the last step of learning, and once more for every fire, as chance has its part in each.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.effect.field.wind import peak_level
from fire_atlas.generators.profile.generate.generated_fire import (
    GeneratedFire,
    ProfileFireSettings,
)
from fire_atlas.generators.profile.generate.rendering import lean_curve, renderings
from fire_atlas.generators.profile.learn.features import FireMask, feature_points, largest_flame
from fire_atlas.generators.profile.learn.measure import frame_difference
from fire_atlas.generators.profile.model import PoseCurves, Profile, node_heights
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind

_MIN_GAIN, _MAX_GAIN = 0.7, 1.25
"""Bounds of the factor by which a sway is corrected at a time."""

_PROFILE_FRAMES, _PROFILE_ROUNDS = 160, 4
"""Frames generated to calibrate a profile, and how often: one correction is not quite enough."""

_MIN_SPEED = 0.75
"""Least playback speed of a profile."""

_TIMING_ROUNDS = 8
"""How often frame times are changed, at most. Where they were, other moments are seen."""

_ALIKE = 0.05
"""Steps whose logarithms differ by less than this are taken for alike."""

_MAX_SEAM = 0.15
"""Logarithm by which a loop's last step may differ from the median one."""

_HEADROOM = 0.95
"""Part of the largest step allowed that is aimed at."""

_SLOWING_POWER = 3.0
"""Time is slowed by this power of what a step is too large by: part of a step is flicker, which is
there however short it is, and all that is slowed here goes faster elsewhere."""


@dataclass(frozen=True, slots=True)
class FireMeasurements:
    """Measurements of a generated fire, seen from its front at the clip's scale.

    Attributes:
        leans: Of the outlines, degrees, of every frame with a flame in it.
        sways: Lean of the pose curves, degrees, of the same frames.
        steps: Difference of each frame from the next; of a loop, also of the last from the first.
    """

    leans: NDArray[np.float64]
    sways: NDArray[np.float64]
    steps: NDArray[np.float64]

    def lean_correction(self, target: NDArray[np.float64]) -> tuple[float, float]:
        """Return the factor of the sway, and the degrees of lean to add, that give the ``leans``
        the variance and the median of those of the ``target``."""
        if not self.leans.size:
            return 1.0, 0.0
        more = (target.var() - self.leans.var()) / max(float(self.sways.var()), 1e-3)
        gain = min(max(math.sqrt(max(1 + more, 0.0)), _MIN_GAIN), _MAX_GAIN)
        return gain, float(np.median(target) - np.median(self.leans))


def measure_fire(fire: GeneratedFire, workers: Workers) -> FireMeasurements:
    """Measure every frame of ``fire``, in the colours it was learnt in."""
    profile = fire.profile
    fire = replace(fire, profile=replace(profile, colours=profile.learnt_colours))
    [rendering] = renderings(fire, [0.0], 0.0, None)
    everywhere = np.ones((rendering.camera.height, rendering.camera.width), np.float32)
    mask = FireMask(profile.front.threshold, everywhere, everywhere, False, "srgb")
    top = int(np.argmin(np.abs(node_heights() - 1.0)))

    def measured(i: int) -> tuple[float, float, Pixels]:
        pose = rendering.pose(i)
        frame = rendering.posed_frame(i, pose)
        flame = largest_flame(mask.binarized(frame))
        sway = math.degrees(math.atan(pose.offset[top]))
        return feature_points(flame).lean if flame.any() else math.nan, sway, frame

    found, steps = [], []
    first: Pixels | None = None
    before: Pixels | None = None
    for lean, sway, frame in workers.map(measured, range(fire.settings.frames)):
        if before is not None:
            steps.append(frame_difference(before, frame))
        first, before = frame if first is None else first, frame
        found.append((lean, sway))
    if fire.settings.loop and first is not None and before is not None:
        steps.append(frame_difference(before, first))
    leans, sways = np.array([each for each in found if not math.isnan(each[0])]).reshape(-1, 2).T
    return FireMeasurements(leans, sways, np.array(steps))


def calibrate_profile(profile: Profile, workers: Workers) -> Profile:
    """Correct a profile so that fire generated from it leans as the clip does, and changes from
    frame to frame hardly more than it."""
    target, step = np.array(profile.front.leans), profile.front.statistics.step
    for seed in range(_PROFILE_ROUNDS):
        generation = GenerationSettings(
            seed, Wind(), _PROFILE_FRAMES, profile.front.fps, True, Views()
        )
        settings = ProfileFireSettings(generation, slices=12, particles=60)
        made = measure_fire(GeneratedFire.of(profile, settings), workers)
        # Chance has its part in every round: the later, the less is changed for it.
        share = 1.0 / (seed + 1)
        gain, lean = made.lean_correction(target)
        large_step = float(np.quantile(made.steps, 0.99))
        speed = profile.playback_speed * (step / max(large_step, 1e-9)) ** share
        speed = round(min(max(speed, _MIN_SPEED), 1.0), 3)
        profile = replace(
            _with_sway_corrected(profile, gain**share, lean * share), playback_speed=speed
        )
    return profile


def _with_sway_corrected(profile: Profile, gain: float, lean: float) -> Profile:
    """Return ``profile`` with its front swaying ``gain`` times as far, about a middle that leans
    ``lean`` degrees more to the right."""
    side = profile.front
    offset = side.pose.offset
    mean = offset.mean(axis=0)
    bent = math.tan(math.radians(lean)) * lean_curve(node_heights())
    corrected = mean + (offset - mean) * gain + bent
    pose = PoseCurves(corrected.round(5), side.pose.width_ratio)
    return replace(profile, front=replace(side, pose=pose))


def calibrate(profile: Profile, settings: ProfileFireSettings, workers: Workers) -> GeneratedFire:
    """Generate a fire, and correct it so that its mean lean matches the clip's and no step between
    frames exceeds the clip's 99th percentile."""
    return _with_timing_corrected(_with_lean_corrected(profile, settings, workers), workers)


def _with_lean_corrected(
    profile: Profile, settings: ProfileFireSettings, workers: Workers
) -> GeneratedFire:
    """Generate a fire that in still air leans as its clip does."""
    leans, generation = np.array(profile.front.leans), settings.generation
    still_air = replace(settings, generation=replace(generation, wind=Wind()))
    calm = GeneratedFire.of(profile, still_air)
    gain, lean = measure_fire(calm, workers).lean_correction(leans)
    # What is too short to show all of the clip need not lean as all of it does.
    share = min(generation.frames * calm.sequences[0].rate / len(leans), 1.0)
    fire = GeneratedFire.of(profile, settings)
    return replace(fire, sway_gain=gain**share, lean_bias=lean * share)


def _with_timing_corrected(fire: GeneratedFire, workers: Workers) -> GeneratedFire:
    """Return ``fire`` with frame times at which it does not jump, and closes unseen."""
    settings, sequence = fire.settings, fire.sequences[0]
    # Of a clip played faster than the result every so many frames are seen. A cartoon that is held
    # jumps as its clip does, and so does a fire in wind.
    max_step = fire.profile.front.statistics.step * max(sequence.rate, 1.0)
    if sequence.holds or peak_level(settings.wind) > 0:
        max_step = math.inf
    best, least = fire, math.inf
    for _ in range(_TIMING_ROUNDS):
        steps = measure_fire(fire, workers).steps
        seam = float(_deviation(steps)[-1]) / _MAX_SEAM if settings.loop else 0.0
        jump = float(steps.max(initial=0.0)) / max_step
        if max(seam, jump) < least:
            best, least = fire, max(seam, jump)
        if least <= 1.0:
            break
        if seam > 1.0:
            times = _times_from_usual_step(fire, steps)
        else:
            times = _times_of_small_steps(fire, steps, _HEADROOM * max_step)
        fire = replace(fire, frame_times=times)
    return best


def _deviation(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the absolute logarithm of each step divided by the median one."""
    size = np.maximum(steps, 1e-9)
    return np.asarray(np.abs(np.log(size / np.median(size))))


def _times_from_usual_step(fire: GeneratedFire, steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the times of a loop that begins after a step of about the median size, and no further
    from its present beginning than need be: the wind is not moved along."""
    number = len(steps)
    later = np.arange(number)
    distance = np.minimum(later, number - later) / number
    start = int(np.argmin(np.maximum(np.roll(_deviation(steps), 1), _ALIKE) + distance))
    return np.append(fire.frame_times[start:], fire.frame_times[:start] + fire.period)


def _times_of_small_steps(
    fire: GeneratedFire, steps: NDArray[np.float64], max_step: float
) -> NDArray[np.float64]:
    """Return frame times between which ``fire`` changes by ``max_step`` at most."""
    times = fire.frame_times
    if fire.settings.loop:
        times = np.append(times, times[0] + fire.period)
    # Not all can be slower than the mean.
    slowing = np.maximum(steps / max(max_step, float(steps.mean())), 1.0) ** _SLOWING_POWER
    place = np.append(0.0, np.cumsum(slowing))
    place *= len(steps) / place[-1]
    return np.asarray(np.interp(np.arange(fire.settings.frames), place, times))
