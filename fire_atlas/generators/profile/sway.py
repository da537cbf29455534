"""How a fire sways: each height as the part of the clip does that was born there.

All of a flame sways as one: the clip says how in a vertical plane, and in two planes at a right
angle it does so apart, so that it sways alike as seen from anywhere. Each plane goes by a clock of
the slices, so that the sway and some of the detail are of one moment of the clip; and a splice
climbs through the sway with the flame's gases.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.profile.force import Weather
from fire_atlas.generators.profile.model import Side
from fire_atlas.generators.profile.particles import height_after
from fire_atlas.generators.profile.pose import Pose, node_heights, resting
from fire_atlas.generators.profile.splices import Reel, Splice, splices_of

_PASSING = 0.6
"""Part of a life in which, at any height, one splice passes into the next."""


@dataclass(frozen=True, slots=True)
class Swing:
    """Sway in one vertical plane.

    Attributes:
        pose: How the flame stands in each frame of the clip.
        rests: (NODES,) where its middle is on average, and (frames, NODES) for a while.
        reel: How its clip is played.
        splices: What is played when.
        rising: (NODES,) frames after which what was born at the base is at each height.
        period: Frames after which all begins anew.
    """

    pose: Pose
    rests: tuple[NDArray[np.float64], NDArray[np.float64]]
    reel: Reel
    splices: tuple[Splice, ...]
    rising: NDArray[np.float64]
    period: int

    @classmethod
    def of(
        cls, side: Side, reel: Reel, rise: float, climb: float, life: int, period: int,
        weather: Weather, seed: int, clock: int,
    ) -> "Swing":  # fmt: skip
        """Sway as ``side`` does.

        Args:
            side, reel: What is played, and how.
            rise, climb, life: What is born reaches the top, at this speed in ``climb`` s, in
                ``life`` frames.
            period: As of the class.
            weather: What the wind does.
            seed: Of the recipe.
            clock: 0 in the plane of the front, 1 at a right angle to it.
        """
        offset = side.face.pose.offset
        share = np.linspace(0.0, 1.0, 256)
        rising = np.interp(node_heights(), height_after(share * climb, rise), share * life)
        splices = splices_of(side, reel, period, weather, clock * math.pi / 2, seed, clock)
        rests = offset.mean(axis=0), resting(offset, side.closed)
        return cls(side.face.pose, rests, reel, splices, rising, period)

    def at(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(NODES,) offsets from where the middle rests, and logarithms of the width's ratio, at a
        ``time`` in frames."""
        passing = _PASSING * float(self.rising[-1])
        starts = np.array([splice.start for splice in self.splices])
        lasts = (np.append(starts[1:], starts[0]) - starts) % self.period
        lasts[lasts == 0] = self.period
        since = np.mod(time - self.rising - starts[:, None] + passing / 2, self.period)
        weights = smooth_step(since / passing)
        weights *= smooth_step((lasts[:, None] + passing - since) / passing)
        # At most heights one splice is seen, at some it passes into the next.
        which, node = np.nonzero(weights)
        weight, seen = weights[which, node], [self.splices[i] for i in which]
        age = (since[which, node] - passing / 2 + self.rising[node]).round(6)
        first, second, part = self.reel.places(np.array([each.first for each in seen]), age)

        def shown(curves: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(curves[first, node] * (1 - part) + curves[second, node] * part)

        def summed(values: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(np.bincount(node, values, len(self.rising)), np.float64)

        usual, now = self.rests
        rest = np.where([each.forced for each in seen], shown(now), usual[node])
        moved = shown(self.pose.offset) - rest
        moved = np.where([each.mirrored for each in seen], -moved, moved)
        spread = np.sqrt(np.maximum(summed(weight * weight), 1e-30))
        wide = np.log(shown(self.pose.ratio))
        return summed(weight * moved) / spread, summed(weight * wide) / spread
