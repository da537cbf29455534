"""How a flame stands in each frame: where its middle runs and how wide it is, from base to tip.

The six points say where a flame begins and ends. Between them it sways like a cloth: that is
learnt as two curves over height, and taken out of the frames before their detail is looked at.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.profile.measure import Measures

NODES = 16
"""Heights at which the curves are known; between them cubic splines run."""

HIGHEST = 1.6
"""Height of the last node, in flame heights."""

_WHILE = 6.0
"""Part of the clip that counts as a while."""

_ALONG, _OVER, _BROAD = 0.06, 0.6, 0.3
"""Widths of smoothing: over height in flame heights, over time in frames, and of what stands in
where a row is dark."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Curves over height of every frame.

    Attributes:
        offset: (frames, NODES) of the middle from the axis, flame heights, to the right.
        ratio: (frames, NODES) of the width to its mean over the clip.
    """

    offset: NDArray[np.float64]
    ratio: NDArray[np.float64]


def node_heights() -> NDArray[np.float64]:
    """(NODES,) heights of the nodes above the base, flame heights."""
    return np.linspace(0.0, HIGHEST, NODES)


def along(curve: NDArray[np.float64], heights: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return a curve (NODES,) at any ``heights``; beyond its ends it stays as it is there."""
    return np.asarray(_shares()(np.clip(heights, 0.0, HIGHEST)) @ curve, np.float64)


@cache
def _shares() -> CubicSpline:
    """What each node has of a cubic spline through all of them, level at its ends: (NODES,)."""
    return CubicSpline(node_heights(), np.eye(NODES), bc_type="clamped")


def resting(offset: NDArray[np.float64], closed: bool) -> NDArray[np.float64]:
    """(frames, NODES): about which the middle sways quickly in each frame: where it is on average
    for a while before and after."""
    sigma = len(offset) / _WHILE
    return np.asarray(
        gaussian_filter1d(offset, sigma, axis=0, mode="wrap" if closed else "reflect")
    )


def pose_of(measures: Measures, closed: bool) -> Pose:
    """Return the pose of every frame; ``closed`` says that the first follows the last."""
    (x, foot), height = measures.base, measures.height
    rows = foot - (np.arange(measures.mass.shape[1]) + 0.5)
    mode = "wrap" if closed else "nearest"
    above = rows > 0
    mass = measures.mass * above
    offset = _smooth(mass, (measures.centre - x) / height, height, mode)
    spread = _smooth(mass, measures.spread / height, height, mode)
    ratio = np.clip(spread / np.maximum(spread.mean(axis=0), 1e-3), 0.7, 1.4)
    # Row 0 is the highest.
    order = rows[::-1] / height
    nodes = node_heights()
    foothold = smooth_step(nodes / 0.2)

    def at_nodes(values: NDArray[np.float64], rest: float) -> NDArray[np.float64]:
        found = np.stack([np.interp(nodes, order, each[::-1]) for each in values])
        return rest + (found - rest) * foothold

    return Pose(at_nodes(offset, 0.0).round(5), at_nodes(ratio, 1.0).round(5))


def _smooth(
    mass: NDArray[np.float64], values: NDArray[np.float64], height: float, mode: str
) -> NDArray[np.float64]:
    """Smooth ``values`` (frames, H) by how much light each row has; dark rows take what is near."""
    sigma = (_OVER, _ALONG * height)

    def blurred(plane: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(gaussian_filter(plane, sigma, mode=(mode, "nearest")))

    light, told = blurred(mass), blurred(mass * values)
    broad = _BROAD * height
    wide_light = gaussian_filter1d(light, broad, axis=1) + 1e-9
    wide = gaussian_filter1d(told, broad, axis=1) / wide_light
    prior = 0.05 * light.max()
    return np.asarray((told + prior * wide) / (light + prior), np.float64)
