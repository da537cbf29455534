"""Choose frames spread evenly over a clip, and look at a few pairs of neighbours."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.vision.thumbnails import distance, shrunk

_PAIRS = 8
"""Steps between neighbouring frames that are looked at, evenly spread over the clip."""

_SIDE = 96
"""Longest side, px, at which these frames are compared."""


def evenly_spread(first: int, last: int, most: int) -> list[int]:
    """Return at most ``most`` whole numbers from ``first`` to ``last``, both included, ascending.

    Where there are no more than that, these are all; none where ``last`` is before ``first``.
    """
    if last < first:
        return []
    return sorted({round(float(i)) for i in np.linspace(first, last, most)})


@dataclass(frozen=True, slots=True)
class ClipSamples:
    """A few frames of a clip, small.

    Attributes:
        count: Frames of the clip.
        frames: The small copies by frame number, first and last among them, in order.
        starts: Frames whose next one is there too.
    """

    count: int
    frames: Mapping[int, Pixels]
    starts: tuple[int, ...]

    @classmethod
    def of(cls, clip: Clip, workers: Workers) -> "ClipSamples":
        """Read and shrink a few frames of ``clip``."""
        starts = evenly_spread(0, max(clip.count - 2, 0), _PAIRS)
        needed = {0, clip.count - 1, *starts, *(i + 1 for i in starts)}
        numbers = sorted(i for i in needed if i < clip.count)
        small = workers.map(lambda i: shrunk(clip.read(i), _SIDE), numbers)
        return cls(clip.count, dict(zip(numbers, small, strict=True)), tuple(starts))

    def steps(self) -> list[float]:
        """Distances between neighbours."""
        return [distance(self.frames[i], self.frames[i + 1]) for i in self.starts]
