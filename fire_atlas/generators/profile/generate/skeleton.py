"""The six feature points of a generated fire: the curve that emits particles, and their paths
(the path builder of Lee et al., III-C, Figure 11)."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fire_atlas.generators.profile.generate.generated_fire import PlaneOfFire, frames_of
from fire_atlas.generators.profile.model import FeaturePoints

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

_LEFT, _BOTTOM, _RIGHT, _TOP = 0, 2, 4, 5
"""Indices of points, in the order of ``FeaturePoints``."""

_FOOT = 0.55
"""Height up to which the emitting curve bends the fire above it, flame heights."""

_MIN_SPAN = 0.02
"""Minimum distance of neighbouring points of the emitting curve, flame heights."""


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The six feature points of a fire in one frame, seen by one camera, before the wind bends it.

    Attributes:
        points: (6, 2) distance to the right of the axis and height above the base, flame heights,
            in the order of ``FeaturePoints``: left to right along the lower outline, then the top.
    """

    points: NDArray[np.float64]

    @property
    def bottom(self) -> NDArray[np.float64]:
        """(2,) the lowest point."""
        return np.asarray(self.points[_BOTTOM])

    @property
    def top(self) -> NDArray[np.float64]:
        """(2,) the highest point."""
        return np.asarray(self.points[_TOP])

    @property
    def height(self) -> float:
        """Height of the top above the bottom."""
        return max(float(self.top[1] - self.bottom[1]), _MIN_SPAN)

    @property
    def foot(self) -> tuple[float, float]:
        """Middle and half the width of the foot."""
        left, right = float(self.points[_LEFT, 0]), float(self.points[_RIGHT, 0])
        return (left + right) / 2, max((right - left) / 2, _MIN_SPAN)

    def emitting_curve(self) -> "PchipInterpolator":
        """Return the height at which particles are born, by the distance to the right of the axis:
        a cubic spline through five points that goes no further than they do between two of them
        (Fritsch and Carlson's), however near to each other they were moved."""
        from scipy.interpolate import PchipInterpolator  # slow to import, and seldom needed

        lower = self.points[: _RIGHT + 1]
        x, height = lower[np.argsort(lower[:, 0], kind="stable")].T
        # Points in one column would give no curve.
        apart = np.maximum(np.diff(x), _MIN_SPAN)
        return PchipInterpolator(x[0] + np.append(0.0, np.cumsum(apart)), height)

    def paths(
        self, across: NDArray[np.float64], share: NDArray[np.float64], taper: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the places (n, 2) of particles on their cubic curves to the top.

        Args:
            across: (n,) where each was born, -1 at the left end of the foot to 1 at the right.
            share: (n,) share of the way to the top, in height; beyond 1 they go straight on.
            taper: (2,) coefficients of ``taper_curve``.
        """
        middle, half = self.foot
        x = middle + across * half
        born = self.emitting_curve()(x)
        axis = (self.top[0] - self.bottom[0]) * lean_curve(share)
        places = self.bottom[0] + axis + (x - self.bottom[0]) * taper_curve(share, taper)
        # The bends of the lower outline are soon lost on the way up.
        bent = (born - self.bottom[1]) * (1 - np.minimum(share, 1.0)) ** 3
        return np.stack([places, self.bottom[1] + self.height * share + bent], axis=1)


def taper_curve(
    share: NDArray[np.float64], coefficients: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how far paths are from the axis, relative to their births: a cubic that is 1 at the
    base and 0 at the top."""
    s = np.minimum(share, 1.0)
    return np.asarray((1 - s) * (1 + coefficients[0] * s + coefficients[1] * s * s))


def lean_curve(heights: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the sideways shift of a leaning fire by height in flame heights, relative to that of
    its top: a cubic that is vertical at the base and straight above the top."""
    h = np.maximum(heights, 0.0)
    return np.asarray(np.where(h < 1, h * h * (3 - h) / 2, 1 + 1.5 * (h - 1)), np.float64)


@dataclass(frozen=True, slots=True)
class Displacement:
    """How a fire moves when its points are moved from where the clip has them.

    Attributes:
        learnt: Where the clip has them.
        moved: Where they are.
    """

    learnt: Skeleton
    moved: Skeleton

    def heights(self, heights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the heights in the clip of ``heights`` in the fire."""
        bottom = float(self.moved.bottom[1] - self.learnt.bottom[1])
        return np.asarray((heights - bottom) * self.learnt.height / self.moved.height)

    def middle(self, heights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far to the right the fire's middle moves at ``heights``."""
        foot = self.moved.foot[0] - self.learnt.foot[0]
        return np.asarray(
            (self.moved.top[0] - self.learnt.top[0] - foot) * lean_curve(heights) + foot
        )

    def width(self, heights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the factor of the fire's width at ``heights``."""
        return np.asarray(1 + (self.moved.foot[1] / self.learnt.foot[1] - 1) * _at_foot(heights))

    def raised(self, x: NDArray[np.float64], heights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far the fire is raised at ``heights`` and at places ``x`` to the right of the
        axis, all of one shape."""
        # A place of the moved foot is further out, or in, on the learnt one.
        (middle, half), (learnt_middle, learnt_half) = self.moved.foot, self.learnt.foot
        there = learnt_middle + (x - middle) * (learnt_half / half)
        curves = [skeleton.emitting_curve() for skeleton in (self.moved, self.learnt)]
        moved, learnt = (
            curve(np.clip(places, curve.x[0], curve.x[-1]))
            for curve, places in zip(curves, (x, there), strict=True)
        )
        bottom = self.moved.bottom[1] - self.learnt.bottom[1]
        return np.asarray(_at_foot(heights) * (moved - learnt - bottom))


def _at_foot(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much of a change of the foot is seen at ``heights``: 1 at the base."""
    return np.square(1 - np.clip(heights / _FOOT, 0.0, 1.0))


def skeletons(planes: tuple[PlaneOfFire, PlaneOfFire], time: float, azimuth: float) -> Displacement:
    """Return the six points at a ``time`` in frames, seen from ``azimuth`` in radians, as the fire
    would stand if nothing bent it."""
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    learnt, moved = np.zeros((2, 6, 2))
    for plane, component in zip(planes, (cos, sin), strict=True):
        for moment in plane.playback.moments(time):
            for frame, share in frames_of(moment):
                weight, mirrored = share * component**2, moment.mirrored != (component < 0)
                learnt += weight * _seen(plane, plane.side.learnt_points[frame], mirrored)
                moved += weight * _seen(plane, plane.side.points[frame], mirrored)
    return Displacement(Skeleton(learnt), Skeleton(moved))


def _seen(plane: PlaneOfFire, points: FeaturePoints, mirrored: bool) -> NDArray[np.float64]:
    """Return points (6, 2) of the clip in flame heights."""
    (x, ground), unit = plane.base, plane.side.statistics.height.median
    array = np.array(points)
    seen = np.stack([(array[:, 0] - x) / unit, (ground - array[:, 1]) / unit], axis=1)
    if mirrored:
        seen = seen[[4, 3, 2, 1, 0, 5]] * (-1, 1)
    return seen
