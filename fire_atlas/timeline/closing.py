"""Clips that close: after the last frame the first follows as any frame follows another."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline

_PAIRS = 8
"""Steps between neighbouring frames that are looked at, evenly spread over the clip."""

_SIDE = 96
"""Longest side, px, at which frames are compared."""

_SEAM = 1.25
"""A seam this many times the median step is no more seen than the steps are."""


def arrange(clip: Clip, timeline: Timeline, workers: Workers) -> Clip:
    """Return the clip as the recipe's ``timeline`` plays it."""
    return replace(clip, loop=timeline.loop == "auto" and is_closed(clip, workers))


def is_closed(clip: Clip, workers: Workers) -> bool:
    """Whether the step from the last frame to the first is like those in between."""
    if clip.count < 3:
        return False
    starts = sorted({round(i) for i in np.linspace(0, clip.count - 2, _PAIRS)})
    needed = sorted({0, clip.count - 1, *starts, *(i + 1 for i in starts)})
    small = dict(zip(needed, workers.map(lambda i: _small(clip, i), needed), strict=True))
    steps = [_distance(small[i], small[i + 1]) for i in starts]
    return _distance(small[clip.count - 1], small[0]) <= _SEAM * float(np.median(steps))


def _small(clip: Clip, i: int) -> NDArray[np.float32]:
    scale = min(1.0, _SIDE / max(clip.width, clip.height))
    size = max(1, round(clip.width * scale)), max(1, round(clip.height * scale))
    return np.asarray(cv2.resize(clip.read(i), size, interpolation=cv2.INTER_AREA), np.float32)


def _distance(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Root mean square difference of two frames, linear and premultiplied."""
    return float(np.sqrt(np.mean((one - other) ** 2)))
