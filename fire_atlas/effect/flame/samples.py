"""Small copies of a few runs of successive frames: how a flame moves and looks, at little cost."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import Picture, as_bytes, as_light
from fire_atlas.core.pixels import (
    Bytes,
    Pixels,
    Plane,
    as_plane,
    brightness,
    magnitude,
)
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flame.segmentation import FlameSegmentation
from fire_atlas.vision.flow import optical_flow, resized, thumbnail
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.thumbnails import shrunk

_RUNS, _RUN = 4, 4
"""Number of runs, and of successive frames in each. Flames pulse at up to half the frame rate: the
motion of one step alone might be the way back of the one before it."""

_SIDE = 96
"""Longest side of a copy, px."""

_PIXELS = 128 * 128
"""About the maximum number of a frame's own pixels whose colours are kept."""


@dataclass(frozen=True, slots=True)
class FrameSample:
    """A frame, small.

    Attributes:
        pixels: (h, w, 4) small copy.
        brightness: (h, w) of the copy, 0..255.
        flame: (h, w), confidence 0..1 that each pixel of the copy is flame.
        colours: (rows, w, 4) some rows of the frame, straight sRGB and coverage, bytes.
    """

    pixels: Pixels
    brightness: Plane
    flame: Plane
    colours: Bytes


@dataclass(frozen=True, slots=True)
class FlameSamples:
    """Samples of a clip.

    Attributes:
        frames: Samples by the number of their frame, in the order of the clip.
        velocities: (runs, 2) mean velocity of the flame in each run, heights/s, y down.
        speed: Mean speed of the flame's parts, whatever their directions, heights/s.
    """

    frames: dict[int, FrameSample]
    velocities: NDArray[np.float64]
    speed: float

    @classmethod
    def of(cls, clip: Clip, segmentation: FlameSegmentation, workers: Workers) -> "FlameSamples":
        """Read a few frames of a clip and measure the flow between neighbours."""
        length = min(_RUN, clip.body)
        runs = [range(i, i + length) for i in evenly_spread(0, clip.body - length, _RUNS)]
        numbers = sorted({i for run in runs for i in run})
        size = shrunk(np.empty((clip.height, clip.width, 1), np.float32), _SIDE).shape
        small = segmentation.resized((size[1], size[0]))
        sampled = workers.map(lambda i: _sample(clip.picture(i), small, clip.blend_space), numbers)
        frames = dict(zip(numbers, sampled, strict=True))
        steps = sorted({step for run in runs for step in pairwise(run)})
        flows = workers.map(lambda s: _step(frames[s[0]], frames[s[1]], clip.fps), steps)
        measured = dict(zip(steps, flows, strict=True))
        if not steps:
            return cls(frames, np.zeros((1, 2)), 0.0)
        velocities = [np.mean([measured[s][:2] for s in pairwise(run)], axis=0) for run in runs]
        speed = float(np.mean([step[2] for step in measured.values()]))
        return cls(frames, np.array(velocities), speed)


def _sample(picture: Picture, segmentation: FlameSegmentation, blend_space: str) -> FrameSample:
    """Return the sample of a frame; ``segmentation`` has the size of the copy."""
    stride = max(1, math.ceil(picture.shape[0] * picture.shape[1] / _PIXELS))
    rows = np.ascontiguousarray(picture[stride // 2 :: stride])
    # A copy shows no more than this of the pixels; to convert them all would take most of the time.
    step = max(1, max(picture.shape[:2]) // (2 * _SIDE))
    columns = np.arange(0, picture.shape[1], step)
    height, width = segmentation.activity.shape
    pixels = resized(as_light(picture[::step].take(columns, axis=1)), (width, height))
    plane = brightness(pixels, blend_space)
    flame = segmentation.mask(plane, lambda: pixels)
    return FrameSample(pixels, plane, flame, as_bytes(rows))


def _step(before: FrameSample, after: FrameSample, fps: float) -> tuple[float, float, float]:
    """Return the flame's mean velocity (x, y) and mean speed between two frames, heights/s."""
    here, there = (thumbnail(sample.brightness, is_small=True) for sample in (before, after))
    flow = optical_flow(here, there, is_small=True)
    height, width = flow.shape[:2]
    weight = resized(as_plane(before.flame * before.brightness), (width, height))
    total = max(float(weight.sum()), 1e-6)
    # In heights of the frame, whose pixels the copy may have stretched a little.
    across = before.flame.shape[1] / before.flame.shape[0] / width
    u, v = flow[..., 0] * np.float32(across * fps), flow[..., 1] * np.float32(fps / height)
    parts = (u, v, magnitude(u, v))
    x, y, speed = (float((part * weight).sum()) / total for part in parts)
    return x, y, speed
