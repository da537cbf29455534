"""The last step of learning: some fire is generated, measured as the clip was, and put right.

How far the tip of a flame leans depends on which of its tongues is the tallest, and parts of
different moments side by side do not agree on that as the tongues of one moment do.
"""

import math
from dataclasses import replace

import numpy as np

from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.blaze import Blaze, Burning
from fire_atlas.generators.profile.camera import bend
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.profile.pose import Pose, node_heights
from fire_atlas.generators.profile.trial import tried
from fire_atlas.recipe.wind import Wind

_FRAMES = 160
"""Frames that are generated to be measured."""

_ROUNDS = 4
"""How often. What is put right once is not quite right yet."""

_CALM = 1.0
"""How restless generated fire is to be, at its most, of how restless the clip is."""

_SLOWEST = 0.75
"""Least pace."""


def tempered(profile: Profile, workers: Workers) -> Profile:
    """Return ``profile`` changed so that generated fire leans as the clip does, and so that its
    neighbouring frames hardly differ by more than the clip's."""
    wanted = np.array(profile.front.leans)
    for seed in range(_ROUNDS):
        asked = Burning(seed, _FRAMES, profile.front.fps, True, 12, 60, Wind())
        made = tried(Blaze.of(profile, asked), workers)
        # Chance has its part in every trial: the later, the less is changed for it.
        share = 1.0 / (seed + 1)
        gain, lean = made.mending(wanted)
        restless = float(np.quantile(made.steps, 0.99))
        pace = profile.pace * (_CALM * profile.front.statistics.step / max(restless, 1e-9)) ** share
        profile = _changed(
            profile, gain**share, lean * share, round(min(max(pace, _SLOWEST), 1.0), 3)
        )
    return profile


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
