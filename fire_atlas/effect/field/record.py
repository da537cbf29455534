"""The buoyancy field of every frame, for flakes to fly in."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane
from fire_atlas.effect.field.air import Air

_OVERLAP = 0.25
"""Seconds over which the end of a loop's field passes into its beginning."""


def overlap_frames(fps: float) -> int:
    """Frames over which the end of a loop's field passes into its beginning."""
    return max(1, round(_OVERLAP * fps))


@dataclass(frozen=True, slots=True)
class FieldRecord:
    """The buoyancy field of every frame.

    Attributes:
        u, v: (frames, rows, columns) float32, px/s.
        lit: (frames, rows, columns) uint8, how bright each cell is; 255 is as bright as flame.
        cell: px.
        fps: Frames per second.
        loop: Whether frame 0 follows the last frame.
    """

    u: NDArray[np.float32]
    v: NDArray[np.float32]
    lit: NDArray[np.uint8]
    cell: int
    fps: float
    loop: bool

    @classmethod
    def blank(cls, frames: int, shape: tuple[int, int], cell: int, fps: float, loop: bool) -> Self:
        """Return a record of still air, to be written frame by frame."""
        u, v = (np.zeros((frames, *shape), np.float32) for _ in range(2))
        return cls(u, v, np.zeros(u.shape, np.uint8), cell, fps, loop)

    def write(self, frame: int, air: Air, lit: Plane) -> None:
        """Record one frame; what goes on past the end of a loop passes into its beginning.

        A simulation does not come back bit for bit by waiting: in its first frames the
        air that was there when the loop began gives way to the air that its end leads to.
        """
        past_end = frame - len(self.u)
        if past_end < 0:
            self.u[frame], self.v[frame] = air.u, air.v
            self.lit[frame] = np.rint(lit * 255)
            return
        went_on = np.float32(1 - past_end / overlap_frames(self.fps))
        for plane, now in ((self.u, air.u), (self.v, air.v)):
            began = plane[past_end % len(plane)]
            began += (now - began) * went_on

    def at(self, time: float) -> NDArray[np.float32]:
        """u, v (px/s) and lit (0..1) of each cell, (rows, columns, 3), at ``time`` s.

        Before and after, a loop goes round and another clip holds its ends. Flow leads from a frame
        to the next, so a frame's field is that of half a frame later. From there it passes into the
        next one's smoothly and late, for what a frame shows lasts for most of the frame.
        """
        count = len(self.u)
        position = time * self.fps - 0.5
        if not self.loop:
            position = min(max(position, 0.0), count - 1.0)
        first = int(np.floor(position))
        part = _smooth(position - first)
        here, there = first % count, (first + 1) % count if self.loop or part else first % count
        planes = (
            cv2.addWeighted(
                of[here], (1 - part) / white, of[there], part / white, 0.0, dtype=cv2.CV_32F
            )
            for of, white in ((self.u, 1), (self.v, 1), (self.lit, 255))
        )
        return np.asarray(cv2.merge(tuple(planes)), np.float32)


def _smooth(part: float) -> float:
    """Pass from 0 to 1 with no slope and no bend at either end."""
    return part**3 * (part * (6 * part - 15) + 10)
