"""Random access to the decoded frames of a file of any format.

The reader of each format returns a ``FrameReader``. This module has the parts that they share:
random access to formats that decode only forwards, and a cache.
"""

import threading
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import CroppedPicture, Picture
from fire_atlas.core.progress import Progress, SilentProgress
from fire_atlas.core.workers import Workers
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.sources.frame_store import FrameStore
from fire_atlas.sources.framing import Fade, PageLimit
from fire_atlas.sources.matte import MatteChoice

CACHE_BYTES = 64 << 20
"""Limit on the cache of decoded frames, bytes, whatever the length of a clip."""

Player = Callable[[], Generator[Picture]]
"""Yields the frames of a file in order, from the first one."""


@dataclass(frozen=True, slots=True)
class OpeningContext:
    """What opening frames needs besides their path and settings.

    Attributes:
        blend_space: Encoding in which the client blends, for the luminance matte.
        workers: Pool that crops and reduces the frames of videos, and looks for flame.
        page: The page that the frames should fit; None if they are not packed themselves.
        max_pixels: Limit on the pixels of a picture.
        progress: Counts frames of a video that are decoded, and of a fire that is simulated.
    """

    blend_space: str
    workers: Workers
    page: PageLimit | None = None
    max_pixels: int = MAX_PIXELS
    progress: Progress = field(default_factory=SilentProgress)


@dataclass(frozen=True, slots=True)
class FrameReader:
    """Random access to frames of one size, in the number format of their file.

    Attributes:
        width, height: Size of the frames, px.
        fps: Frames per second that the file states; None if it states none.
        count: Number of frames.
        read: ``read(i)`` returns frame i. Several threads may call it at once.
        inputs: The files that are read, in order.
        notes: What was decided about the frames, and why, for the user.
        matte: The matte, by whole frames, if the frames are cropped to their flame, which leaves
            nothing of the background by which one is chosen.
        fade: How light fades out at the sides of the frames, once they have their matte; None if
            it does not.
    """

    width: int
    height: int
    fps: float | None
    count: int
    read: Callable[[int], Picture]
    inputs: tuple[Path, ...]
    notes: tuple[str, ...] = ()
    matte: MatteChoice | None = None
    fade: Fade | None = None


def check_frame_size(path: Path, i: int, picture: Picture, size: tuple[int, int]) -> None:
    """Refuse a frame of another size than ``size`` (width, height), px.

    Raises:
        SourceError: With both sizes.
    """
    if picture.shape[:2] != size[::-1]:
        raise SourceError(
            f"{path}: frame {i} is {picture.shape[1]}x{picture.shape[0]}, but the others are "
            f"{size[0]}x{size[1]}; all frames must have one size"
        )


class SequentialDecoder:
    """Random access to the frames of a format that can only be decoded forwards, and only once.

    Frames are decoded up to the one that is read, and kept in a ``FrameStore``.
    """

    def __init__(self, path: Path, play: Player) -> None:
        """Decode nothing yet; ``path`` is the file, for error messages."""
        self._path, self._play = path, play
        self._lock = threading.Lock()
        self._begin()

    def _begin(self) -> None:
        self._frames, self._playing, self._next = FrameStore(self._path), self._play(), 0

    def read(self, i: int) -> Picture:
        """Return frame i, read-only. Several threads may call this at once."""
        with self._lock:
            while self._next <= i:
                self._decode_next()
            frames = self._frames
        return frames.read(i)

    def _decode_next(self) -> None:
        try:
            self._frames.add(self._next, next(self._playing))
        except BaseException:
            # Whatever stopped the decoder, a later call must start from the first frame.
            self._begin()
            raise
        self._next += 1


def cached(reader: FrameReader) -> FrameReader:
    """Return ``reader`` with a cache that keeps frames until it is full and never drops any.

    It holds ``CACHE_BYTES``. Frames are read several times: to choose the matte (where alpha comes
    from), to analyse the clip and to draw it.
    """
    kept: dict[int, CroppedPicture] = {}
    room = [CACHE_BYTES]

    def read(i: int) -> Picture:
        known = kept.get(i)
        if known is not None:
            return known.whole(copy=False)
        picture = reader.read(i)
        cropped = CroppedPicture.of(picture)
        if cropped.part.nbytes <= room[0]:
            room[0] -= cropped.part.nbytes
            kept[i] = cropped
        return picture

    return replace(reader, read=read)
