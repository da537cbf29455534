"""A clip: frames of one size at a constant rate, read on demand."""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import Picture, as_light, brightness_of
from fire_atlas.core.pixels import Pixels, Plane

CACHE_BYTES = 64 * 1024 * 1024
"""Size of the frames that ``cached`` keeps. A constant: memory must not grow with a clip."""


class Window(NamedTuple):
    """A rectangle of the frame, px; ``right`` and ``bottom`` are excluded."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns, as an index into a picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class Skipped(NamedTuple):
    """A frame of the source that the clip does not show.

    Attributes:
        part: When it is shown: the part of the step from one frame to the next, 0..1.
        read: Returns its pixels.
    """

    part: float
    read: Callable[[], Pixels]


@dataclass(frozen=True, slots=True)
class Clip:
    """Frames of one size at a constant rate, read on demand so that none has to be kept.

    Attributes:
        width, height: Frame size, px.
        fps: Frames per second of the clip.
        count: Number of frames, at least 1.
        picture: ``picture(i)`` gives frame i, 0 <= i < count, (height, width, 4): as its file holds
            it, not to be written to, or as a fresh ``Pixels``. Safe to call from several threads.
        loop: Whether frame 0 follows the last frame.
        backwards: Frames after which the clip runs backwards (ping-pong).
        tail: Number of frames at the end that only let flakes burn out: none is born there.
        inputs: Every file the frames come from, in order, for the manifest.
        blend_space: ``srgb`` or ``linear``: where the coverage is meant to be blended.
        matte: ``alpha``, ``luminance`` or ``none``: where the coverage comes from.
        matte_reason: Why that matte was chosen, as a sentence for people.
        flow: ``flow(i)`` gives the velocity at each pixel of frame i, (height, width, 2) float32, x
            and y in px/s, where a generator knows it. None: it has to be estimated.
        skipped: Where the source has more frames than the clip: by frame, a source frame about
            halfway to the next.
    """

    width: int
    height: int
    fps: float
    count: int
    picture: Callable[[int], Picture]
    inputs: tuple[Path, ...]
    blend_space: str
    matte: str
    matte_reason: str
    loop: bool = False
    backwards: frozenset[int] = frozenset()
    tail: int = 0
    flow: Callable[[int], NDArray[np.float32]] | None = None
    skipped: Mapping[int, Skipped] = field(default_factory=dict)

    @property
    def body(self) -> int:
        """Number of frames before the tail."""
        return self.count - self.tail

    def read(self, i: int) -> Pixels:
        """Return frame ``i`` as ``Pixels``, (height, width, 4), in a fresh array."""
        return as_light(self.picture(i))

    def brightness(self, i: int) -> Plane:
        """Return the brightness of frame ``i``, (height, width) in 0..255; see ``pixels``."""
        return brightness_of(self.picture(i), self.blend_space)


def cropped(clip: Clip, window: Window) -> Clip:
    """Return the clip with every frame cropped to ``window``."""
    flow = clip.flow
    return replace(
        clip,
        width=window.right - window.left,
        height=window.bottom - window.top,
        picture=lambda i: np.ascontiguousarray(clip.picture(i)[window.slices]),
        flow=None if flow is None else lambda i: np.ascontiguousarray(flow(i)[window.slices]),
        skipped={},
    )


def cached(picture: Callable[[int], Picture], made: Container[int]) -> Callable[[int], Picture]:
    """Return a clip's ``picture`` that keeps computed frames, each of which is read several times.

    The first frames that are read are kept, up to ``CACHE_BYTES``. What is returned is always a
    fresh array. Threads that ask at the same time may each compute the same frame.

    Args:
        picture: Gives frame i, as of ``Clip``.
        made: Numbers of the frames that are computed; all others are cheap to read again.
    """
    kept: dict[int, Picture] = {}
    free = [CACHE_BYTES]

    def read(i: int) -> Picture:
        known = kept.get(i)
        if known is not None:
            return known.copy()
        frame = picture(i)
        if i in made and frame.nbytes <= free[0]:
            free[0] -= frame.nbytes
            kept[i] = frame.copy()
        return frame

    return read
