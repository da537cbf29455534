"""Small copies of many frames of a clip, and the difference between any two of them."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, brightness, luminance
from fire_atlas.core.workers import Workers
from fire_atlas.vision.flow import mean_flow, thumbnail_of
from fire_atlas.vision.steps import held_steps, median_step

_SIDE = 64
"""Longest side of a copy, px."""

_FLOW_AREA = 128 * 128
"""Maximum area, px, at which the flow between frames is estimated."""


def shrunk(pixels: Pixels, side: int) -> Pixels:
    """Return ``pixels`` shrunk so that no side is longer than ``side`` px."""
    height, width = pixels.shape[:2]
    scale = min(1.0, side / max(width, height))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return as_plane(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA))


def distance(one: Pixels, other: Pixels) -> float:
    """Return the root mean square difference of two frames, linear and premultiplied."""
    return float(np.sqrt(np.mean((one - other) ** 2)))


def detail_energy(pixels: Pixels) -> float:
    """Return the mean squared gradient of a frame's luminance; blur and ghosts lower it."""
    light = luminance(pixels)
    return gradient_product(light, light)


def gradient_product(one: Plane, other: Plane) -> float:
    """Return the mean dot product of the gradients of two planes."""
    total = 0.0
    for axis in ((1, 0), (0, 1)):
        slope = cv2.Sobel(one, cv2.CV_32F, *axis)
        with_other = slope if other is one else cv2.Sobel(other, cv2.CV_32F, *axis)
        total += float(cv2.mean(cv2.multiply(slope, with_other))[0])
    return total


@dataclass(frozen=True, slots=True)
class Thumbnails:
    """Small copies of the frames of a clip.

    Attributes:
        frames: (n, h, w, 4) float32, linear light, premultiplied.
        distances: (n, n) float32, root mean square difference of any two frames.
        flows: (n,) mean length of the optical flow from each frame to the next, and from the last
            to the first, weighted by light, px at ``_FLOW_AREA``.
        details: (n,) mean squared gradient of each frame's luminance, at full size.
    """

    frames: NDArray[np.float32]
    distances: NDArray[np.float32]
    flows: NDArray[np.float64]
    details: NDArray[np.float64]

    @classmethod
    def of(cls, clip: Clip, numbers: Iterable[int], workers: Workers) -> "Thumbnails":
        """Measure the frames ``numbers`` of ``clip``."""
        measured = list(workers.map(lambda i: _measured(clip.read(i), clip.blend_space), numbers))
        frames = np.stack([small for small, _, _ in measured])
        seen = [picture for _, picture, _ in measured]
        details = np.array([detail for _, _, detail in measured])
        # ‖a − b‖² = ‖a‖² + ‖b‖² − 2ab; subtracting the mean first loses fewer digits.
        rows = as_plane((frames - frames.mean(axis=0)).reshape(len(frames), -1))
        products = rows @ rows.T
        power = np.diag(products)
        square = np.maximum(power[:, None] + power[None] - 2 * products, 0) / rows.shape[1]
        flows = list(
            workers.map(lambda i: mean_flow(seen[i - 1], seen[i], False), range(len(seen)))
        )
        return cls(frames, as_plane(np.sqrt(square)), np.roll(np.array(flows), -1), details)

    @property
    def median_step(self) -> float:
        """Median distance between neighbouring frames that show different drawings."""
        return median_step(np.diag(self.distances, 1), closed=False)

    def held(self, closed: bool) -> NDArray[np.bool_]:
        """Return ``steps.held_steps`` of the frames; ``closed`` if the first follows the last."""
        lengths = np.diag(self.distances, 1)
        return held_steps(np.append(lengths, self.distances[-1, 0]) if closed else lengths, closed)

    @property
    def median_distance(self) -> float:
        """Median distance between any two frames."""
        return float(np.median(self.distances[np.triu_indices(len(self.distances), 1)]))


def _measured(pixels: Pixels, blend_space: str) -> tuple[Pixels, Bytes, float]:
    """Return a small copy, the picture on which flow is estimated, and the detail of a frame."""
    picture = thumbnail_of(brightness(pixels, blend_space), _FLOW_AREA)
    return shrunk(pixels, _SIDE), picture, detail_energy(pixels)
