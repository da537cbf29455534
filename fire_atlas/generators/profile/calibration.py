"""Calibrate generated fire: correct its lean and its timing until both match the clip's.

Generated fire shows parts of different moments of the clip side by side. Their tallest tongues lean
differently from those of a single moment, so the lean of the whole differs from the clip's. Several
parts may also change in the same frame, which makes larger steps than the clip has. So a fire is
generated, measured as the clip was, and corrected: once for the profile, as the last step of
learning, and again for every generated fire, because each is random.
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
"""Limits on the factor of a single correction of the sway."""

_PROFILE_FRAMES, _PROFILE_ROUNDS = 160, 4
"""Frames generated in each round of calibrating a profile, and number of rounds."""

_MIN_SPEED = 0.75
"""Minimum playback speed of a profile."""

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


@dataclass(frozen=True, slots=True)
class FireMeasurements:
    """Measurements of a generated fire, seen from the front at the clip's scale.

    Attributes:
        leans: Lean of the outline, degrees, in every frame that shows a flame.
        sways: Lean of the pose curve, degrees, in the same frames.
        steps: Difference of each frame from the next; in a loop, also of the last from the first.
    """

    leans: NDArray[np.float64]
    sways: NDArray[np.float64]
    steps: NDArray[np.float64]

    def lean_correction(self, target: NDArray[np.float64]) -> tuple[float, float]:
        """Return the factor of the sway and the degrees to add to the lean that give ``leans`` the
        variance and the median of ``target``."""
        if not self.leans.size:
            return 1.0, 0.0
        more = (target.var() - self.leans.var()) / max(float(self.sways.var()), 1e-3)
        gain = min(max(math.sqrt(max(1 + more, 0.0)), _MIN_GAIN), _MAX_GAIN)
        return gain, float(np.median(target) - np.median(self.leans))


def measure_fire(fire: GeneratedFire, workers: Workers) -> FireMeasurements:
    """Measure every frame of ``fire``, drawn in the clip's own colours."""
    profile = fire.profile
    fire = replace(fire, profile=replace(profile, colours=profile.learnt_colours))
    [rendering] = renderings(fire, [0.0], 0.0, None)
    no_masking = np.ones((rendering.camera.height, rendering.camera.width), np.float32)
    mask = FireMask(profile.front.threshold, no_masking, no_masking, False, "srgb")
    top = int(np.argmin(np.abs(node_heights() - 1.0)))

    def measure_frame(i: int) -> tuple[float, float, Pixels]:
        pose = rendering.pose(i)
        frame = rendering.posed_frame(i, pose)
        flame = largest_flame(mask.binarized(frame))
        sway = math.degrees(math.atan(pose.offset[top]))
        return feature_points(flame).lean if flame.any() else math.nan, sway, frame

    angles, steps = [], []
    first: Pixels | None = None
    previous: Pixels | None = None
    for lean, sway, frame in workers.map(measure_frame, range(fire.settings.frames)):
        if previous is not None:
            steps.append(frame_difference(previous, frame))
        first, previous = frame if first is None else first, frame
        angles.append((lean, sway))
    if fire.settings.loop and first is not None and previous is not None:
        steps.append(frame_difference(previous, first))
    leans, sways = np.array([each for each in angles if not math.isnan(each[0])]).reshape(-1, 2).T
    return FireMeasurements(leans, sways, np.array(steps))


def calibrate_profile(profile: Profile, workers: Workers) -> Profile:
    """Correct a profile so that fire generated from it leans as the clip does and changes hardly
    more from frame to frame."""
    target, step = np.array(profile.front.leans), profile.front.statistics.step
    for seed in range(_PROFILE_ROUNDS):
        generation = GenerationSettings(
            seed, Wind(), _PROFILE_FRAMES, profile.front.fps, True, Views()
        )
        settings = ProfileFireSettings(generation, slices=12, particles=60)
        measurements = measure_fire(GeneratedFire.of(profile, settings), workers)
        # Each round generates another random fire, so later rounds correct less.
        share = 1.0 / (seed + 1)
        gain, lean = measurements.lean_correction(target)
        large_step = float(np.quantile(measurements.steps, 0.99))
        speed = profile.playback_speed * (step / max(large_step, 1e-9)) ** share
        speed = round(min(max(speed, _MIN_SPEED), 1.0), 3)
        profile = replace(
            _with_sway_corrected(profile, gain**share, lean * share), playback_speed=speed
        )
    return profile


def _with_sway_corrected(profile: Profile, gain: float, lean: float) -> Profile:
    """Return ``profile`` with the sway of its front scaled by ``gain``, about a middle that leans
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
    """Generate a fire that leans, in still air, as its clip does."""
    leans, generation = np.array(profile.front.leans), settings.generation
    still_air = replace(settings, generation=replace(generation, wind=Wind()))
    calm = GeneratedFire.of(profile, still_air)
    gain, lean = measure_fire(calm, workers).lean_correction(leans)
    # A fire too short to show the whole clip is corrected in proportion to its length.
    share = min(generation.frames * calm.sequences[0].rate / len(leans), 1.0)
    fire = GeneratedFire.of(profile, settings)
    return replace(fire, sway_gain=gain**share, lean_bias=lean * share)


def _with_timing_corrected(fire: GeneratedFire, workers: Workers) -> GeneratedFire:
    """Return ``fire`` with frame times without jumps and, in a loop, without a visible seam."""
    settings, sequence = fire.settings, fire.sequences[0]
    # If frames of the clip are skipped, steps are larger than the clip's. A cartoon with held
    # frames, or a fire in wind, may take steps of any size.
    max_step = fire.profile.front.statistics.step * max(sequence.rate, 1.0)
    if sequence.holds or peak_level(settings.wind) > 0:
        max_step = math.inf
    best, best_excess = fire, math.inf
    for _ in range(_TIMING_ROUNDS):
        steps = measure_fire(fire, workers).steps
        seam = float(_deviation(steps)[-1]) / _MAX_SEAM if settings.loop else 0.0
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
