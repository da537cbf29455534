"""Measure how well an animation loops: its seam (last to first frame) against its other steps."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Pixels, brightness, luminance
from fire_atlas.vision.flow import SMALL, mean_flow, thumbnail
from fire_atlas.vision.steps import median_step
from fire_atlas.vision.thumbnails import distance, gradient_product

Figures = NDArray[np.float64]
"""(n,) one value per frame."""


@dataclass(frozen=True, slots=True)
class LoopFigures:
    """Measurements of the frames of a loop and of the steps between them.

    Step i leads from frame i to the next. The last step, the seam, leads to the first frame.

    Attributes:
        steps: (n,) root mean square difference of the two frames, linear and premultiplied.
        flows: (n,) mean length of the optical flow, weighted by light, px of a thumbnail.
        details: (n,) mean squared gradient of each frame's luminance; ghosts and blur lower it.
        light: (n,) mean luminance of each frame.
    """

    steps: Figures
    flows: Figures
    details: Figures
    light: Figures

    @property
    def _usual_step(self) -> np.floating:
        """Median length of the steps that lead to another drawing."""
        return np.float64(median_step(self.steps, closed=True))

    @property
    def seam_ratio(self) -> float:
        """The step at the seam divided by the median step. From 0.8 to 1.25 nobody sees it."""
        return _ratio(self.steps[-1], self._usual_step)

    @property
    def largest_step(self) -> float:
        """The largest step divided by the median step."""
        return _ratio(self.steps.max(), self._usual_step)

    @property
    def smallest_step(self) -> float:
        """The smallest step divided by the median step. Near 0, a frame is shown twice."""
        return _ratio(self.steps.min(), self._usual_step)

    @property
    def seam_flow(self) -> float:
        """The flow at the seam divided by the 95th percentile of the other steps' flow."""
        return _ratio(self.flows[-1], np.percentile(self.flows[:-1], 95))

    @property
    def least_detail(self) -> float:
        """The lowest detail of a frame divided by the median."""
        return _ratio(self.details.min(), np.median(self.details))

    @property
    def seam_light(self) -> float:
        """The change of light at the seam divided by the 95th percentile of the other changes."""
        changes = np.abs(np.diff(self.light, append=self.light[:1]))
        return _ratio(changes[-1], np.percentile(changes[:-1], 95))


def loop_figures(frames: Iterable[Pixels]) -> LoopFigures:
    """Measure a loop of at least two ``frames``, (H, W, 4) each, in playing order.

    They are read one by one: at most three are in memory.
    """
    steps, flows, details, light = [], [], [], []
    first = before = None
    for frame in frames:
        here = _MeasuredFrame.of(frame)
        details.append(here.detail)
        light.append(here.light)
        if before is not None:
            steps.append(distance(before.frame, here.frame))
            flows.append(mean_flow(before.thumbnail, here.thumbnail, here.is_small))
        first, before = first or here, here
    if first is None or before is None or first is before:
        raise ValueError("a loop has at least two frames")
    steps.append(distance(before.frame, first.frame))
    flows.append(mean_flow(before.thumbnail, first.thumbnail, first.is_small))
    return LoopFigures(*(np.array(column) for column in (steps, flows, details, light)))


@dataclass(frozen=True, slots=True)
class _MeasuredFrame:
    """A frame and those of its measurements that do not depend on other frames."""

    frame: Pixels
    thumbnail: Bytes
    is_small: bool
    detail: float
    light: float

    @classmethod
    def of(cls, frame: Pixels) -> "_MeasuredFrame":
        light = luminance(frame)
        is_small = light.size <= SMALL
        return cls(
            frame,
            thumbnail(brightness(frame, "linear"), is_small),
            is_small,
            gradient_product(light, light),
            float(light.mean(dtype=np.float64)),
        )


def _ratio(value: np.floating, usual: np.floating) -> float:
    """Return ``value / usual``; 1 if both are 0."""
    if usual > 0:
        return float(value / usual)
    return 1.0 if value == 0 else float("inf")
