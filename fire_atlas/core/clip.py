"""A clip: the frames every later step looks at."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import Picture, as_light, brightness_of
from fire_atlas.core.pixels import Pixels, Plane


class Window(NamedTuple):
    """A part of the frame, px: columns ``left`` to ``right``, rows ``top`` to ``bottom``, the last
    ones excluded."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns, to index a picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class Skipped(NamedTuple):
    """A frame of the source that the clip does not show.

    Attributes:
        part: How much of the step from one frame to the next is over then, 0..1.
        read: Reads it.
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
        backwards: Frames after which the clip runs against the time it was made in.
        tail: How many of the last frames are there for flakes to burn out in: none is born there.
        inputs: Every file the frames come from, in order, for the manifest.
        blend_space: ``srgb`` or ``linear``: where the coverage is meant to be blended.
        matte: ``alpha``, ``luminance`` or ``none``: where the coverage comes from.
        matte_reason: Why that matte was chosen, as a sentence for people.
        flow: ``flow(i)`` gives the velocity of what frame i shows, (height, width, 2) float32, x
            and y in px/s, for fire whose maker knows it. None: it has to be seen in the frames.
        skipped: By frame, one of the source about halfway to the next, where the source has more
            frames than the clip shows.
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
        """Frame ``i`` in light, (height, width, 4), a fresh array."""
        return as_light(self.picture(i))

    def brightness(self, i: int) -> Plane:
        """How bright frame ``i`` is, (height, width) in 0..255, as of ``pixels.brightness``."""
        return brightness_of(self.picture(i), self.blend_space)


def cropped(clip: Clip, window: Window) -> Clip:
    """The part of every frame that lies in ``window``."""
    flow = clip.flow
    return replace(
        clip,
        width=window.right - window.left,
        height=window.bottom - window.top,
        picture=lambda i: np.ascontiguousarray(clip.picture(i)[window.slices]),
        flow=None if flow is None else lambda i: np.ascontiguousarray(flow(i)[window.slices]),
        skipped={},
    )
