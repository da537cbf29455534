"""A reel: the decoded frames of a file or folder, before cutting, matting and resizing."""

import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from fire_atlas.core.picture import Picture

_RING_BYTES = 64 << 20

Player = Callable[[], Generator[Picture]]
"""Starts from the first frame and yields each, in order."""


@dataclass(frozen=True, slots=True)
class Reel:
    """Frames of one size as their files hold them.

    Attributes:
        width, height: px.
        fps: Frames per second the file asks for; None if it does not say.
        count: Number of frames.
        read: Frame i as a picture; safe to call from several threads.
        inputs: The files, in order: one a frame, or one for all.
    """

    width: int
    height: int
    fps: float | None
    count: int
    read: Callable[[int], Picture]
    inputs: tuple[Path, ...]


class SequentialFrames:
    """Gives frames by number from a format that can only be played forwards.

    The last decoded frames are kept, as many as there is room for: a short clip is played once, of
    a longer one threads may ask a little out of order. Only a frame older than these makes it play
    again from the start.
    """

    def __init__(self, play: Player, frame_bytes: int) -> None:
        """Play nothing yet; ``frame_bytes`` decides how many frames are kept."""
        self._play = play
        self._kept = max((os.cpu_count() or 1) + 2, _RING_BYTES // max(1, frame_bytes))
        self._ring: OrderedDict[int, Picture] = OrderedDict()
        self._lock = threading.Lock()
        self._playing: Generator[Picture] | None = None
        self._next = 0

    def read(self, i: int) -> Picture:
        """Return frame i; must not be written to, as it may be given out again."""
        with self._lock:
            if i not in self._ring:
                self._wind_to(i)
            return self._ring[i]

    def _wind_to(self, i: int) -> None:
        if self._playing is None or i < self._next:
            if self._playing is not None:
                self._playing.close()
            self._playing, self._next = self._play(), 0
            self._ring.clear()
        while self._next <= i:
            try:
                self._ring[self._next] = next(self._playing)
            except BaseException:
                # Whatever stopped the decoder, a later call must start afresh.
                self._playing = None
                raise
            self._next += 1
            if len(self._ring) > self._kept:
                self._ring.popitem(last=False)


def played(
    path: Path, size: tuple[int, int], play: Player, fps: float | None, shown: Sequence[int]
) -> Reel:
    """Return the reel of a file that is played forwards, one frame after the other.

    Args:
        path: The file.
        size: (width, height) of its frames, px.
        play: Starts from its first frame.
        fps: Frames per second of the reel.
        shown: For each frame of the reel, the number of the file's frame that it shows.
    """
    width, height = size
    frames = SequentialFrames(play, width * height * 4)
    return Reel(
        width=width,
        height=height,
        fps=fps,
        count=len(shown),
        read=lambda i: frames.read(shown[i]),
        inputs=(path,),
    )
