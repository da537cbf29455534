"""What keys of fire learnt from a clip promise to be seen."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, encode_unit
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.fire import generate_clips, learn_profile
from fire_atlas.generators.profile.generate.generated_fire import ProfileFireSettings
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.source import ProfileSource, Views
from fire_atlas.recipe.wind import Wind
from tests.support.clips import open_clip, proxied
from tests.support.effect import (
    Array,
)
from tests.support.promises.promise import Figure, Promise, Scale, Unit, mean, merged, nested


@dataclass(frozen=True)
class Generated:
    """Fire generated from a profile, seen from one side.

    Attributes:
        clip: Its frames.
        threshold: Brightness above which a pixel is flame, 0..255.
    """

    clip: Clip
    threshold: float

    @cached_property
    def leans(self) -> Array:
        """Lean of the flame in each frame, degrees, by the line fitted to its pixels."""
        found = []
        for i in range(self.clip.count):
            bright = self.clip.brightness(i)
            rows, columns = np.nonzero(bright > min(self.threshold, 0.5 * float(bright.max())))
            found.append(-np.degrees(np.arctan(np.polyfit(rows, columns, 1)[0])))
        return np.array(found)

    def frames(self) -> list[Pixels]:
        """Return some of its frames."""
        return [self.clip.read(i) for i in range(2, self.clip.count, 3)]


def _mean_lean(fire: Generated) -> float:
    return mean(fire.leans)


def _lean_swing(fire: Generated) -> float:
    return float(np.std(fire.leans))


def _lean_swings(fire: Generated) -> float:
    """Return how often the lean swings to and fro, a second."""
    strength = np.abs(np.fft.rfft(fire.leans - fire.leans.mean(), 8 * len(fire.leans)))
    return float(np.fft.rfftfreq(8 * len(fire.leans), 1 / fire.clip.fps)[np.argmax(strength)])


def _lean_change(fire: Generated) -> float:
    quarter = fire.clip.count // 4
    return mean(fire.leans[-quarter:]) - mean(fire.leans[:quarter])


def _top(fire: Generated) -> float:
    """Return the height of the flame, of its width."""
    found = []
    for frame in fire.frames():
        shown = frame[..., 3] > 0.3
        height, width = (np.ptp(np.flatnonzero(shown.any(axis=k))) for k in (1, 0))
        found.append(height / width)
    return mean(found)


def _slopes(fire: Generated) -> float:
    """Return the mean slope of the brightness as shown within the flame, 1/px, of 255."""
    found = []
    for frame in fire.frames():
        shown = encode_unit(np.ascontiguousarray(frame[..., :3])).max(axis=2)
        found.append(255 * float(np.hypot(*np.gradient(shown))[frame[..., 3] > 0.2].mean()))
    return mean(found)


def _step(fire: Generated) -> float:
    """Return the difference of neighbouring frames, of their light, %."""
    frames = [fire.clip.read(i)[..., :3] for i in range(fire.clip.count)]
    steps = [np.abs(b - a).sum() / a.sum() for a, b in pairwise(frames)]
    return 100 * float(np.median(steps))


def _hues(fire: Generated) -> float:
    """Return how unlike colours are within the flame: the spread of green over red, %."""
    found = []
    for frame in fire.frames():
        flame = frame[frame[..., 3] > 0.5]
        found.append(float(np.std(flame[:, 1] / np.maximum(flame[:, 0], 1e-3))))
    return 100 * mean(found)


LEAN = Figure("mean lean of the flame", Unit.DEGREES, _mean_lean)
LEAN_SWING = Figure("swing of its lean (rms)", Unit.DEGREES, _lean_swing)
LEAN_SWINGS = Figure("swings of its lean, a second", Unit.NUMBER, _lean_swings)
LEAN_CHANGE = Figure("change of its lean over time", Unit.DEGREES, _lean_change)
TOP = Figure("height of the flame as seen, of its width", Unit.NUMBER, _top)
SLOPES = Figure("slope of the brightness in the flame", Unit.NUMBER, _slopes)
STEP = Figure("step from frame to frame, of the light", Unit.NUMBER, _step)
HUES = Figure("spread of green over red in the flame", Unit.NUMBER, _hues)

PARTICLES = {"source": {"detail": 0.0}}


def _of_fire(
    key: str, sentence: str, figure: Figure, low: Any, high: Any, *, rises: bool = True,
    needs: Mapping[str, Mapping[str, Any]] | None = None, clip: str = "torch",
) -> Promise:  # fmt: skip
    """Return a promise about fire that is generated from a clip."""
    return Promise(key, sentence, figure, low, high, rises, needs or {}, clip, fire="profile")


PROMISES_OF_PROFILE = (
    _of_fire(
        "source.detail", "Share of the clip's own detail in the picture", SLOPES, 0.0, 1.0
    ),
    _of_fire(
        "source.slices", "Number of vertical slices of fire around the axis", STEP, 1, 12,
        rises=False, needs=PARTICLES,
    ),
    _of_fire(
        "source.particles", "Number of particles alive in each slice", STEP, 10, 200, rises=False,
        needs=PARTICLES,
    ),
    _of_fire(
        "source.cells", "Rows, and columns, of the colour table that is learnt", HUES, 2, 10,
        needs=PARTICLES, clip="candle",
    ),
    _of_fire(
        "views.elevation", "Elevation of the cameras above the horizon", TOP, 0.0, 50.0,
        rises=False,
    ),
    _of_fire("wind.level", "Strength of a steady wind", LEAN, 0.0, 5.0),
    _of_fire(
        "wind.direction", "Direction a steady wind or gusts blow towards", LEAN, "left", "right",
        needs={"wind": {"level": 3}},
    ),
    _of_fire(
        "wind.keyframes", "Wind that changes over time", LEAN_CHANGE, [{"t": 0, "level": 0}],
        [{"t": 0.5, "level": 0}, {"t": 1, "level": 4}],
    ),
    _of_fire("wind.levels", "Strengths of steady wind", LEAN, [0, 1], [0, 5]),
    _of_fire("wind.gusts.mean", "Mean strength", LEAN, 1.0, 4.0),
    _of_fire(
        "wind.gusts.strength", "how far it rises above and falls below the mean", LEAN_SWING,
        0.0, 2.0, needs={"wind": {"gusts": {"mean": 2}}}, clip="candle",
    ),
    _of_fire(
        "wind.gusts.period", "Time from gust to gust", LEAN_SWINGS, 0.8, 2.0, rises=False,
        needs={"wind": {"gusts": {"mean": 2, "strength": 2}}}, clip="candle",
    ),
)  # fmt: skip
"""Promises of ``source.kind: profile``, of the wind on it and of its views."""


@lru_cache(maxsize=16)
def _learnt(clip: str, threshold: float | None, cells: int) -> Profile:
    with Workers(2) as workers:
        return learn_profile({clip: proxied(open_clip(clip, "source"))}, workers, threshold, cells)


def generate(promise: Promise, value: Any, seed: int, scale: Scale) -> Generated:
    """Generate fire with the promise's key at ``value``, or left out."""
    keys = merged(promise.needs, nested(promise.key, value) if value is not None else {})
    source = ProfileSource.model_validate({"path": promise.clip, **keys.get("source", {})})
    wind = Wind.model_validate(keys.get("wind", {})).steady()[-1]
    views = Views.model_validate(keys.get("views", {}))
    is_loop = not wind.keyframes
    shared = GenerationSettings(seed, wind, scale.profile_frames, 24.0, is_loop, views)
    settings = ProfileFireSettings(shared, source.slices, source.particles, source.detail)
    profile = _learnt(promise.clip, source.threshold, source.cells)
    with Workers(2) as workers:
        [clip] = generate_clips(profile, settings, scale.height, "srgb", (), workers)
    return Generated(clip, profile.front.threshold)
