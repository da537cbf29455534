"""The last step of learning: some fire is generated, measured as the clip was, and put right.

How far the tip of a flame leans depends on which of its tongues is the tallest, and parts of
different moments side by side do not agree on that as the tongues of one moment do.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.profile.blaze import Blaze, Burning
from fire_atlas.profile.contour import feature_points
from fire_atlas.profile.fire import bend, camera_for, pictured
from fire_atlas.profile.measure import difference
from fire_atlas.profile.model import Profile
from fire_atlas.profile.pose import Pose, node_heights
from fire_atlas.profile.segment import Fire, connected
from fire_atlas.profile.view import View
from fire_atlas.recipe.wind import Wind

_FRAMES = 160
"""Frames that are generated to be measured."""

_ROUNDS = 3
"""How often. What is put right once is not quite right yet."""

_CALMEST, _WILDEST = 0.7, 1.15
"""Bounds of the factor by which the sway is changed."""

_CALM = 0.92
"""How restless generated fire is to be, at its most, of how restless the clip is."""

_SLOWEST = 0.75
"""Least pace."""


@dataclass(frozen=True, slots=True)
class _Trial:
    """What was measured: leans of the outlines and of the curves they sway along, degrees, and the
    99th percentile of the difference of neighbouring frames."""

    leans: NDArray[np.float64]
    sway: NDArray[np.float64]
    step: float


def tempered(profile: Profile, step: float, workers: Workers) -> Profile:
    """Return ``profile`` changed so that generated fire leans as the clip does, and so that its
    neighbouring frames differ by no more than ``step``."""
    wanted = np.array(profile.front.leans)
    for seed in range(_ROUNDS):
        made = _trial(profile, seed, workers)
        if not made.leans.size:
            return profile
        more = (wanted.var() - made.leans.var()) / max(float(made.sway.var()), 1e-3)
        # Half way: the trial is short, and chance has its part in it.
        gain = min(max(max(1 + more, 0.0) ** 0.25, _CALMEST), _WILDEST)
        lean = float(np.median(wanted) - np.median(made.leans))
        pace = profile.pace * min(_CALM * step / max(made.step, 1e-9), 1.0)
        profile = _changed(profile, gain, lean, round(max(pace, _SLOWEST), 3))
    return profile


def _trial(profile: Profile, seed: int, workers: Workers) -> _Trial:
    """Generate some fire in still air, and measure it."""
    asked = Burning(seed, _FRAMES, profile.front.fps, True, 12, 60, Wind())
    blaze = Blaze.of(profile, asked)
    view, camera = View.of(blaze, 0.0), camera_for(blaze, None, 0.0)
    everywhere = np.ones((camera.height, camera.width), np.float32)
    fire = Fire(profile.front.threshold, everywhere, False, "srgb")
    top = int(np.argmin(np.abs(node_heights() - 1.0)))

    def look(i: int) -> tuple[float, float, Pixels]:
        territories = view.territories(i)
        stance = view.stance(i, territories)
        frame = pictured(view, camera, territories, stance)
        flame = connected(fire.lit(frame))
        sway = math.degrees(math.atan(stance.offset[top]))
        return feature_points(flame).lean if flame.any() else math.nan, sway, frame

    found, steps = [], []
    before: Pixels | None = None
    for lean, sway, frame in workers.map(look, range(_FRAMES)):
        if before is not None:
            steps.append(difference(before, frame))
        before = frame
        found.append((lean, sway))
    leans, sways = np.array([each for each in found if not math.isnan(each[0])]).reshape(-1, 2).T
    return _Trial(leans, sways, float(np.quantile(steps, 0.99)))


def _changed(profile: Profile, gain: float, lean: float, pace: float) -> Profile:
    """Return ``profile`` at another pace, its front swaying ``gain`` times as far, about ``lean``
    degrees more to the right."""
    side = profile.front
    offset = side.face.pose.offset
    mean = offset.mean(axis=0)
    changed = mean + (offset - mean) * gain + math.tan(math.radians(lean)) * bend(node_heights())
    pose = Pose(changed.round(5), side.face.pose.ratio)
    face = replace(side.face, pose=pose)
    return replace(profile, pace=pace, front=replace(side, face=face))
