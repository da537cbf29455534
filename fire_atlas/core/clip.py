"""A clip: frames of one size at a constant rate, read on demand."""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from zlib_ng import zlib_ng

from fire_atlas.core.camera import Camera
from fire_atlas.core.picture import CroppedPicture, Picture, as_light, brightness_of
from fire_atlas.core.pixels import Pixels, Plane

Values = NDArray[np.float64]
"""(n,)."""

CACHE_BYTES = COMPRESSED_BYTES = 64 * 1024 * 1024
"""Limits on the frames that ``cached`` keeps as they are, and on those it keeps compressed, bytes,
whatever the length of the clip."""


class Window(NamedTuple):
    """A rectangle of the frame, px. Column ``right`` and row ``bottom`` are just outside of it."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns, as an index into a picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)


class Skipped(NamedTuple):
    """A frame of the source, between two frames of the clip, that the clip leaves out.

    Attributes:
        time: Its time between these two frames, 0..1.
        read: Returns its pixels.
    """

    time: float
    read: Callable[[], Pixels]


class FrontSurface(NamedTuple):
    """The front of the body of a fire in a frame.

    Attributes:
        depth: (height, width) of the front, px towards the viewer; see ``FireInDepth``.
        normal: (height, width, 3) unit vectors that it faces: right, down, towards the viewer.
    """

    depth: Plane
    normal: NDArray[np.float32]

    @classmethod
    def flat(cls, height: int, width: int) -> "FrontSurface":
        """Return that of a frame without fire: it faces the viewer, at depth 0."""
        level = np.broadcast_to(np.array([0, 0, 1], np.float32), (height, width, 3))
        return cls(np.zeros((height, width), np.float32), level)


@dataclass(frozen=True, slots=True)
class FireInDepth:
    """What is known of a fire that was made in three dimensions, besides the frames of one view.

    Places are px of the frame and, in depth, world units times the camera's scale, towards the
    viewer; 0 is the plane of the world's origin. Several threads may call the functions at once.

    Attributes:
        camera: The camera that sees the clip.
        front: The camera in front of the fire, level, with parallel lines of sight, in px of the
            same size.
        seen_by: ``seen_by(camera)`` returns a clip of the fire as another camera sees it.
        fire_depth: ``fire_depth(i, x, y, share)`` returns the depth (n,) at which fire burns, in
            frame i behind places x, y (n,) of a level view: ``share`` (n,) 0..1 of its light there
            comes from behind it.
        hidden: ``hidden(i, x, y, z)`` returns which places (n,) in frame i are behind something
            opaque.
        front_surface: ``front_surface(i)`` returns the front of the fire's body in frame i.
    """

    camera: Camera
    front: Camera
    seen_by: Callable[[Camera], "Clip"]
    fire_depth: Callable[[int, Values, Values, Values], Values]
    hidden: Callable[[int, Values, Values, Values], NDArray[np.bool_]]
    front_surface: Callable[[int], FrontSurface]


@dataclass(frozen=True, slots=True)
class Clip:
    """Frames of one size at a constant rate. They are read on demand and need not be in memory.

    Attributes:
        width, height: Frame size, px.
        fps: Frames per second of the clip.
        count: Number of frames, at least 1.
        picture: ``picture(i)`` returns frame i, 0 <= i < count, (height, width, 4): either as in
            its file and read-only, or new ``Pixels``. Several threads may call it at once.
        loop: Whether frame 0 follows the last frame.
        backwards: Numbers of the frames from which the step to the next one plays the source
            backwards (ping-pong).
        tail: Number of frames appended for the flakes to burn out. No flake is spawned in these.
        inputs: Every file the frames come from, in order, for the manifest.
        blend_space: Encoding in which the client blends frames, ``srgb`` or ``linear``.
        matte: Where the coverage comes from: ``alpha``, ``luminance`` or ``none``.
        matte_reason: Why that matte was chosen, for the user.
        notes: What else was decided about the frames of its files, and why, for the user.
        hue_error: Of frames that are mixed in cross-fades, how far their hues lie outside of the
            clip's own, ΔE (``Palette.hue_error`` of the worst); None if there are none.
        flow: ``flow(i)`` returns the velocity of each pixel of frame i, (height, width, 2) float32,
            x and y in px/s. Set for generated clips; None means that it has to be estimated.
        depth: The fire in three dimensions, if it was made so; None for flat pictures.
        smoke: ``smoke(i)`` returns the share of light, (height, width) 0..1, that black soot keeps
            back in frame i. Set for generated clips; None means that it is part of the pictures.
        solids: ``solids(i)`` returns the light of what stands in the fire, as it is seen through
            the flames of frame i, and the coverage of it, (height, width, 4). Set for fire that is
            made with what stands in it; None means that it is part of the pictures.
        hidden: ``hidden(i)`` returns how much of what is behind frame i is hidden by smoke and by
            what stands in the fire, however much light there is, (height, width) 0..1. None means
            that the pictures tell.
        burning: ``burning(i)`` returns which share of the light of frame i is fire's, and not that
            of smoke in daylight, (height, width) 0..1. None means all.
        skipped: If the source has more frames than the clip: by the number of a frame, a source
            frame about halfway between it and the next.
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
    notes: tuple[str, ...] = ()
    loop: bool = False
    backwards: frozenset[int] = frozenset()
    tail: int = 0
    hue_error: float | None = None
    flow: Callable[[int], NDArray[np.float32]] | None = None
    skipped: Mapping[int, Skipped] = field(default_factory=dict)
    depth: FireInDepth | None = None
    smoke: Callable[[int], Plane] | None = None
    solids: Callable[[int], Pixels] | None = None
    hidden: Callable[[int], Plane] | None = None
    burning: Callable[[int], Plane] | None = None

    @property
    def tiles(self) -> bool:
        """Whether what leaves the frame at one side enters at the other; see ``Camera``."""
        return self.depth is not None and self.depth.camera.tiles

    @property
    def body(self) -> int:
        """Number of frames without the tail."""
        return self.count - self.tail

    def read(self, i: int) -> Pixels:
        """Return frame ``i`` as ``Pixels``, (height, width, 4)."""
        return as_light(self.picture(i))

    def brightness(self, i: int) -> Plane:
        """Return ``pixels.brightness`` of frame ``i``, (height, width) in 0..255."""
        return brightness_of(self.picture(i), self.blend_space)


class ProxiedClip(NamedTuple):
    """A clip, and a small copy of it by which it is judged before it is read.

    Attributes:
        clip: The clip.
        proxy: The same frames, small.
    """

    clip: Clip
    proxy: Clip


def cropped(clip: Clip, window: Window) -> Clip:
    """Return the clip with every frame cropped to ``window``, and without depth."""
    flow, burning = clip.flow, clip.burning
    return replace(
        clip,
        width=window.right - window.left,
        height=window.bottom - window.top,
        picture=lambda i: np.ascontiguousarray(clip.picture(i)[window.slices]),
        burning=None if burning is None else lambda i: burning(i)[window.slices],
        flow=None if flow is None else lambda i: np.ascontiguousarray(flow(i)[window.slices]),
        skipped={},
        depth=None,
    )


def depth_of(clip: Clip) -> FireInDepth:
    """Return the fire of a clip that has depth."""
    if clip.depth is None:
        raise ValueError("the clip is flat")
    return clip.depth


def kept(clip: Clip) -> Clip:
    """Return a generated clip with its frames cached."""
    return replace(clip, picture=cached(clip.picture, range(clip.count)))


def frames_kept(clip: Clip) -> int:
    """Return how many frames ``kept`` keeps at least of a generated clip, the first to be drawn."""
    size = 16 * clip.width * clip.height
    return CACHE_BYTES // size + COMPRESSED_BYTES // size


def cached(picture: Callable[[int], Picture], made: Container[int]) -> Callable[[int], Picture]:
    """Return ``picture`` with a cache: frames are expensive to compute and read several times.

    The first computed frames are kept, up to ``CACHE_BYTES`` in all; the next ones compressed, up
    to ``COMPRESSED_BYTES``: a dozen ms are less than most fire takes to be drawn again. Of each
    only what is not empty is kept. Callers get copies of them. Threads that read a frame at the
    same time may each compute it.

    Args:
        picture: Returns frame i, like ``Clip.picture``.
        made: Numbers of the computed frames. Others are cheap to read again and not kept.
    """
    kept: dict[int, CroppedPicture] = {}
    compressed: dict[int, tuple[bytes, CroppedPicture]] = {}
    free, free_compressed = [CACHE_BYTES], [COMPRESSED_BYTES]

    def read(i: int) -> Picture:
        if (known := kept.get(i)) is not None:
            return known.whole()
        if (packed := compressed.get(i)) is not None:
            data, without = packed
            part = np.frombuffer(zlib_ng.decompress(data), without.part.dtype)
            return replace(without, part=part.reshape(without.part.shape)).whole()
        frame = picture(i)
        if i not in made:
            return frame
        cropped = CroppedPicture.of(frame)
        if cropped.part.nbytes <= free[0]:
            free[0] -= cropped.part.nbytes
            kept[i] = cropped
            return cropped.whole() if cropped.part is frame else frame
        if free_compressed[0] > 0:
            data = zlib_ng.compress(cropped.part.tobytes(), 1)
            if len(data) <= free_compressed[0]:
                free_compressed[0] -= len(data)
                nothing = np.broadcast_to(cropped.part.dtype.type(0), cropped.part.shape)
                compressed[i] = data, replace(cropped, part=nothing)
        return frame

    return read
