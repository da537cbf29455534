"""A clip: the frames every later step looks at."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fire_atlas.core.pixels import Pixels


@dataclass(frozen=True, slots=True)
class Clip:
    """Frames of one size at a constant rate, read on demand so that none has to be kept.

    Attributes:
        width, height: Frame size, px.
        fps: Frames per second of the clip.
        count: Number of frames, at least 1.
        read: ``read(i)`` gives frame i, 0 <= i < count, as read-only ``Pixels`` (height, width, 4).
            Safe to call from several threads.
        loop: Whether frame 0 follows the last frame.
        inputs: Every file the frames come from, in order, for the manifest.
        blend_space: ``srgb`` or ``linear``: where the coverage is meant to be blended.
        matte: ``alpha``, ``luminance`` or ``none``: where the coverage comes from.
        matte_reason: Why that matte was chosen, as a sentence for people.
    """

    width: int
    height: int
    fps: float
    count: int
    read: Callable[[int], Pixels]
    inputs: tuple[Path, ...]
    blend_space: str
    matte: str
    matte_reason: str
    loop: bool = False
