"""Choose frames spread evenly over a clip, and measure how much neighbouring frames differ."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.vision.thumbnails import distance, shrunk

_PAIRS = 8
"""Number of pairs of neighbouring frames that are compared."""

_SIDE = 96
"""Longest side, px, of the small copies of frames that are compared."""


def evenly_spread(first: int, last: int, max_count: int) -> list[int]:
    """Return up to ``max_count`` whole numbers from ``first`` to ``last``, both included.

    They ascend. The list is empty if ``last`` is below ``first``.
    """
    if last < first:
        return []
    return sorted({round(float(i)) for i in np.linspace(first, last, max_count)})


def step_lengths(clip: Clip, workers: Workers) -> NDArray[np.float64]:
    """Return the distance of each frame to the next, of the last to the first if ``clip`` loops."""
    frames = list(workers.map(lambda i: shrunk(clip.read(i), _SIDE), range(clip.count)))
    after = [*frames[1:], frames[0]] if clip.loop else frames[1:]
    return np.array([distance(*pair) for pair in zip(frames, after, strict=False)])


def frame_steps(clip: Clip, workers: Workers) -> NDArray[np.float64]:
    """Return the same of the frames as they are: root mean square differences."""
    count = clip.count if clip.loop else clip.count - 1
    pairs = ((i, (i + 1) % clip.count) for i in range(count))
    return np.array([*workers.map(lambda pair: distance(*map(clip.read, pair)), pairs)])


@dataclass(frozen=True, slots=True)
class ClipSamples:
    """Small copies of a few frames of a clip.

    Attributes:
        count: Number of frames of the clip.
        frames: The copies by frame number, in order, with those of the first and last frame.
        pair_starts: Frame numbers i for which both i and i + 1 are in ``frames``; their distances
            show how large a step between frames usually is.
    """

    count: int
    frames: Mapping[int, Pixels]
    pair_starts: tuple[int, ...]

    @classmethod
    def of(cls, clip: Clip, workers: Workers) -> "ClipSamples":
        """Read and shrink a few frames of ``clip``."""
        starts = evenly_spread(0, clip.count - 2, _PAIRS)
        numbers = sorted({0, clip.count - 1, *starts, *(i + 1 for i in starts)})
        small = workers.map(lambda i: shrunk(clip.read(i), _SIDE), numbers)
        return cls(clip.count, dict(zip(numbers, small, strict=True)), tuple(starts))

    def steps(self) -> list[float]:
        """Return the distance of each frame in ``pair_starts`` to the next one."""
        return [distance(self.frames[i], self.frames[i + 1]) for i in self.pair_starts]
