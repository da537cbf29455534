"""How well an animation goes round, in figures."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Pixels, brightness, luminance
from fire_atlas.vision.flow import SMALL, optical_flow, thumbnail

Figures = NDArray[np.float64]
"""(n,) one value a frame."""


@dataclass(frozen=True, slots=True)
class LoopFigures:
    """What frames and the steps between them measure; step i leads from frame i to the next, and
    the last one, the seam, from the last frame to the first.

    Attributes:
        steps: (n,) root mean square difference of neighbours, linear and premultiplied.
        flows: (n,) mean optical flow from one to the next where there is light, px of a thumbnail.
        details: (n,) mean squared gradient of each frame's luminance: ghosts and blur lower it.
        light: (n,) mean luminance of each frame.
    """

    steps: Figures
    flows: Figures
    details: Figures
    light: Figures

    @property
    def seam_ratio(self) -> float:
        """The seam's step against the median step; 0.8 to 1.25 is not seen."""
        return _ratio(self.steps[-1], np.median(self.steps))

    @property
    def largest_step(self) -> float:
        """The largest step against the median step."""
        return _ratio(self.steps.max(), np.median(self.steps))

    @property
    def smallest_step(self) -> float:
        """The smallest step against the median step; next to 0, a frame is shown twice."""
        return _ratio(self.steps.min(), np.median(self.steps))

    @property
    def seam_flow(self) -> float:
        """Flow at the seam against the 95th percentile of all others."""
        return _ratio(self.flows[-1], np.percentile(self.flows[:-1], 95))

    @property
    def least_detail(self) -> float:
        """Detail of the frame that has least, against the median."""
        return _ratio(self.details.min(), np.median(self.details))

    @property
    def seam_light(self) -> float:
        """Change of light at the seam against the 95th percentile of all others."""
        changes = np.abs(np.diff(self.light, append=self.light[:1]))
        return _ratio(changes[-1], np.percentile(changes[:-1], 95))


def loop_figures(frames: Iterable[Pixels]) -> LoopFigures:
    """Measure ``frames``, (H, W, 4) float32 each, of one size, at least 2, in playing order.

    They are looked at one after the other: only two and the first are in memory.
    """
    steps, flows, details, light = [], [], [], []
    first = before = None
    for frame in frames:
        look = _Look.at(frame)
        details.append(look.detail)
        light.append(look.light)
        if before is not None:
            steps.append(_distance(before, look))
            flows.append(_flow(before, look))
        first, before = first or look, look
    if first is None or before is None or first is before:
        raise ValueError("a loop has at least two frames")
    steps.append(_distance(before, first))
    flows.append(_flow(before, first))
    return LoopFigures(*(np.array(column) for column in (steps, flows, details, light)))


@dataclass(frozen=True, slots=True)
class _Look:
    """What is known of a frame without its neighbours."""

    frame: Pixels
    thumb: Bytes
    detail: float
    light: float

    @classmethod
    def at(cls, frame: Pixels) -> "_Look":
        light = luminance(frame)
        across, down = (cv2.Sobel(light, cv2.CV_32F, *axis) for axis in ((1, 0), (0, 1)))
        return cls(
            frame,
            thumbnail(brightness(frame, "linear"), light.size <= SMALL),
            float(np.mean(across**2 + down**2, dtype=np.float64)),
            float(light.mean(dtype=np.float64)),
        )


def _flow(here: _Look, there: _Look) -> float:
    is_small = here.frame[..., 0].size <= SMALL
    flow = optical_flow(here.thumb, there.thumb, is_small)
    weight = here.thumb.astype(np.float64)
    length = np.hypot(flow[..., 0], flow[..., 1])
    return float((length * weight).sum() / max(weight.sum(), 1.0))


def _distance(one: _Look, other: _Look) -> float:
    return float(np.sqrt(np.mean((one.frame - other.frame) ** 2, dtype=np.float64)))


def _ratio(value: np.floating, usual: np.floating) -> float:
    """``value`` against ``usual``; 1 where neither is anything."""
    if usual > 0:
        return float(value / usual)
    return 1.0 if value == 0 else float("inf")
