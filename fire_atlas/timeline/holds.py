"""The holds of a clip: runs of frames that show the same drawing. They are part of its rhythm."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.workers import Workers
from fire_atlas.vision.sampling import step_lengths
from fire_atlas.vision.steps import held_steps


@dataclass(frozen=True, slots=True)
class Holds:
    """Which frames of a clip show the same drawing.

    Attributes:
        first: (n,) for each frame, the first one that shows its drawing. In a loop it may lie
            before the end, and the frame itself after the start.
        length: (n,) for each frame, how many show its drawing; 1 where nothing is held.
    """

    first: NDArray[np.intp]
    length: NDArray[np.intp]

    @classmethod
    def of(cls, clip: Clip, workers: Workers) -> "Holds":
        """Find the holds of ``clip``."""
        return cls.between(held_steps(step_lengths(clip, workers), clip.loop), clip.loop)

    @classmethod
    def between(cls, held: NDArray[np.bool_], closed: bool) -> "Holds":
        """Return the holds of a clip with these steps; each says whether it only holds a drawing.

        Args:
            held: (n,) for a loop, which is ``closed``; else (n − 1,).
        """
        into = held if closed else np.concatenate([held, [False]])
        begins = ~np.roll(into, 1)  # whether a frame shows another drawing than the one before
        count = len(begins)
        if not begins.any():
            return cls(np.zeros(count, np.intp), np.full(count, count, np.intp))
        starts = np.flatnonzero(begins)
        first = starts[np.cumsum(begins) - 1]  # -1, before the first start, is the last one
        return cls(first, np.bincount(first, minlength=count)[first])

    @classmethod
    def none(cls, count: int) -> "Holds":
        """Return the holds of a clip of ``count`` frames that all differ."""
        return cls(np.arange(count), np.ones(count, np.intp))

    @property
    def starts(self) -> NDArray[np.bool_]:
        """(n,) whether a frame is the first one that shows its drawing."""
        return np.asarray(self.first == np.arange(len(self.first)), np.bool_)

    @property
    def usual(self) -> int:
        """For how many frames a drawing is shown; the median over drawings, rounded down."""
        return int(np.median(self.length[self.starts])) if self.starts.any() else 1

    def start_before(self, i: int) -> int:
        """Return the last first frame of a drawing up to frame ``i``, which is included."""
        return int(np.flatnonzero(self.starts[: i + 1])[-1])

    def rhythm(self, beginning: int, frames: int) -> list[int]:
        """Return for each of ``frames`` frames from ``beginning`` on the number, from 0, of the
        middle one of those that show its drawing: a number that is held as the drawing is."""
        count = len(self.first)
        at = (beginning + np.arange(frames)) % count
        since = (at - self.first[at]) % count
        middle = np.arange(frames) - since + self.length[at] // 2
        return [int(k) for k in np.clip(middle, 0, frames - 1)]

    def is_held(self, i: int) -> bool:
        """Whether frame ``i`` is one of several that show its drawing."""
        return bool(self.length[i] > 1)
