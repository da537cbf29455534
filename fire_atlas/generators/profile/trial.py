"""Generated fire, measured as its clip was, before anybody sees it."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.blaze import Blaze
from fire_atlas.generators.profile.camera import camera_for, pictured
from fire_atlas.generators.profile.contour import feature_points
from fire_atlas.generators.profile.measure import difference
from fire_atlas.generators.profile.pose import node_heights
from fire_atlas.generators.profile.segment import Fire, connected
from fire_atlas.generators.profile.view import View

_CALMEST, _WILDEST = 0.7, 1.25
"""Bounds of the factor by which a sway is changed at a time."""


@dataclass(frozen=True, slots=True)
class Trial:
    """What was measured of a fire from its front, at the clip's scale.

    Attributes:
        leans: Of the outlines, degrees, of every frame with a flame in it.
        sway: Of the curves they sway along, degrees, of the same frames.
        steps: How much each frame differs from the next; of a loop, also the last from the first.
    """

    leans: NDArray[np.float64]
    sway: NDArray[np.float64]
    steps: NDArray[np.float64]

    def mending(self, wanted: NDArray[np.float64]) -> tuple[float, float]:
        """By what to multiply the sway, and how many degrees more to the right to lean, so that the
        ``leans`` would be spread as those ``wanted``, about the same median."""
        if not self.leans.size:
            return 1.0, 0.0
        more = (wanted.var() - self.leans.var()) / max(float(self.sway.var()), 1e-3)
        gain = min(max(math.sqrt(max(1 + more, 0.0)), _CALMEST), _WILDEST)
        return gain, float(np.median(wanted) - np.median(self.leans))


def tried(blaze: Blaze, workers: Workers) -> Trial:
    """Measure every frame of ``blaze``, in the colours it was learnt in."""
    profile = blaze.profile
    blaze = replace(blaze, profile=replace(profile, colours=profile.learnt))
    view, camera = View.of(blaze, 0.0), camera_for(blaze, None, 0.0)
    everywhere = np.ones((camera.height, camera.width), np.float32)
    fire = Fire(profile.front.threshold, everywhere, everywhere, False, "srgb")
    top = int(np.argmin(np.abs(node_heights() - 1.0)))

    def look(i: int) -> tuple[float, float, Pixels]:
        stance = view.stance(i)
        frame = pictured(view, camera, view.territories(i), stance)
        flame = connected(fire.lit(frame))
        sway = math.degrees(math.atan(stance.offset[top]))
        return feature_points(flame).lean if flame.any() else math.nan, sway, frame

    found, steps = [], []
    first: Pixels | None = None
    before: Pixels | None = None
    for lean, sway, frame in workers.map(look, range(blaze.asked.frames)):
        if before is not None:
            steps.append(difference(before, frame))
        first, before = frame if first is None else first, frame
        found.append((lean, sway))
    if blaze.asked.loop and first is not None and before is not None:
        steps.append(difference(before, first))
    leans, sways = np.array([each for each in found if not math.isnan(each[0])]).reshape(-1, 2).T
    return Trial(leans, sways, np.array(steps))
