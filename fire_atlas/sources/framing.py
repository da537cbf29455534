"""Decide which part of the frames of a file is used (``source.crop``), and at which size."""

from collections.abc import Container
from dataclasses import dataclass
from math import ceil, floor
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture, brightest, white
from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, encode_unit
from fire_atlas.recipe.source import FramesSource
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.sources.matte import MatteChoice
from fire_atlas.sources.resize import nearest, reduce, width_for

LARGE = 512
"""Height, px, to which ``height: auto`` reduces taller videos. Frames of this size are kept whole
while a clip is built; taller ones are reduced as they are decoded."""

SMALLEST = 256
"""Height, px, below which ``height: auto`` adds pages instead of reducing a video further."""

_FILLED = 0.9
"""Fraction of a page that frames can be expected to fill."""

_MOVES = 20
"""A pixel whose brightest channel changes by more than this over the clip, of 255, may be flame:
less is the noise of cameras and codecs."""

_GLOWS = 128
"""A pixel whose brightest channel exceeds this, of 255, may be a flame that does not move."""

_MARGIN = 0.04
"""Margin around the flame, as a fraction of the longer side of its box."""

_GROWTH = 0.1
"""Maximum by which glow beyond the margin adds to it, as a fraction of the same side: where it
reaches farther, it fades out there."""

_UNSEEN = 2 / 255
"""Alpha up to which nobody sees an edge."""


@dataclass(frozen=True, slots=True)
class PageLimit:
    """How much fits one page of an atlas, and how many frames a clip puts there.

    Attributes:
        max_size: Maximum width and height of a page, px.
        timeline: The recipe's section.
    """

    max_size: int
    timeline: Timeline

    @property
    def area(self) -> float:
        """Pixels of a page that frames can be expected to fill."""
        return _FILLED * self.max_size**2

    def frames(self, count: int, fps: float) -> int:
        """Return how many frames of a clip of ``count`` frames are shown, if none are cut off."""
        if self.timeline.frames is not None:
            return self.timeline.frames
        shown = round(count * (self.timeline.fps or fps) / fps)
        return max(1, 2 * shown - 2 if self.timeline.loop == "pingpong" else shown)


@dataclass(frozen=True, slots=True)
class Framing:
    """The part of a video's frames that is used, and the size at which it is kept.

    Attributes:
        box: The part, px of the file.
        width, height: Size of the frames that are kept, px: at most that of the box.
        keeps_pixels: Whether they are reduced by nearest neighbour.
        reason: Why the size is not that of the box, for the user; empty if it is.
    """

    box: Window
    width: int
    height: int
    keeps_pixels: bool
    reason: str = ""

    def apply(self, picture: Picture) -> Picture:
        """Return a frame of the file as it is kept."""
        part = picture[self.box.slices]
        if part.shape[:2] == (self.height, self.width):
            return part
        return (nearest if self.keeps_pixels else reduce)(part, self.width, self.height)


def frame_video(
    settings: FramesSource, box: Window, count: int, fps: float, page: PageLimit | None
) -> Framing:
    """Return the framing of a video.

    Args:
        settings: The recipe's ``source``.
        box: The part of the frames that is used, px of the file.
        count: Number of frames that are used.
        fps: Their rate.
        page: The page that the frames should fit; None if they are not packed themselves.
    """
    size = box.right - box.left, box.bottom - box.top
    height, reason = size[1], ""
    if height > LARGE and settings.height == "auto":
        shown = 0 if page is None else page.frames(count, fps)
        height = _height_on_page(size, shown, page)
        reason = _why_reduced(size, height, shown, page)
    elif height > LARGE and isinstance(settings.height, int):
        height = min(height, settings.height)
    width = width_for(height, size)
    return Framing(box, width, height, settings.sampling == "nearest", reason)


def _height_on_page(size: tuple[int, int], shown: int, page: PageLimit | None) -> int:
    """Return the largest height at which ``shown`` frames of this (width, height) fit a page."""
    if page is None:
        return LARGE
    fitting = (
        height
        for height in range(LARGE, SMALLEST, -1)
        if shown * height * width_for(height, size) <= page.area
    )
    return next(fitting, SMALLEST)


def _why_reduced(size: tuple[int, int], height: int, shown: int, page: PageLimit | None) -> str:
    width = width_for(height, size)
    fits = page is not None and SMALLEST < height < LARGE
    why = f", so that {shown} of them fit one page" if fits else ""
    return (
        f"frames of {size[0]}x{size[1]} are reduced to {width}x{height}{why}; source.height: "
        f"source keeps their size"
    )


def stated_box(settings: FramesSource, size: tuple[int, int], path: Path) -> Window:
    """Return the part of frames of ``size`` (width, height) that ``source.crop`` states, if any.

    Raises:
        SourceError: It reaches beyond the frames.
    """
    if isinstance(settings.crop, str):
        return Window(0, 0, *size)
    left, top, width, height = settings.crop
    if left + width > size[0] or top + height > size[1]:
        raise SourceError(
            f"[{left}, {top}, {width}, {height}] reaches beyond the frames of {path}, which are "
            f"{size[0]}x{size[1]}: x + width can be at most {size[0]} and y + height at most "
            f"{size[1]}",
            key=("source", "crop"),
        )
    return Window(left, top, left + width, top + height)


def small_copy(picture: Picture) -> Picture:
    """Return a copy, at most ``LARGE`` px high, in which ``FlameExtent`` looks for flame."""
    height = min(LARGE, picture.shape[0])
    size = width_for(height, (picture.shape[1], picture.shape[0])), height
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA))


@dataclass(frozen=True, slots=True)
class Fade:
    """How light fades to nothing at the sides of frames, so that none shows an edge.

    Attributes:
        across: Widths of the fade at the left and at the right, as fractions of a frame's width.
        down: The same at the top and at the bottom, of its height.
    """

    across: tuple[float, float] = (0.0, 0.0)
    down: tuple[float, float] = (0.0, 0.0)

    def apply(self, pixels: Pixels) -> Pixels:
        """Return pixels (H, W, 4) with the light and alpha that the fade leaves."""
        height, width = pixels.shape[:2]
        left = np.multiply.outer(_shares(height, self.down), _shares(width, self.across))
        return as_plane(left)[..., None] * pixels


def _shares(length: int, fades: tuple[float, float]) -> NDArray[np.float64]:
    """Return the share of light that is left along an axis of ``length`` px: 0 at the outermost."""
    shares = np.ones(length)
    for side, fade in zip((shares, shares[::-1]), fades, strict=True):
        count = round(fade * length)
        x = np.arange(count) / max(count, 1)
        side[:count] *= x * x * (3 - 2 * x)
    return shares


@dataclass(frozen=True, slots=True)
class FlameCrop:
    """The part of the frames that ``crop: auto`` chose, and how its light fades out, if it does."""

    box: Window
    fade: Fade | None = None


class FlameExtent:
    """The box that is ever flame, from small copies of all frames.

    It is rather too large than too small. If anything is transparent, it holds all that is not.
    Otherwise it holds what changes, and what is bright enough to be a steady flame.
    """

    def __init__(self, samples: Container[int] = ()) -> None:
        """Start without a frame; copies of the frames numbered ``samples`` are kept."""
        self._numbers = samples
        self._samples = list[Picture]()
        self._highest = self._lowest = np.zeros((0, 0, 2), np.uint8)

    def add(self, i: int, small: Picture) -> None:
        """Add the ``small_copy`` of frame i; all must have the same size."""
        if i in self._numbers:
            self._samples.append(small)
        measured = _brightness_and_coverage(small)
        if not self._highest.size:
            self._highest = self._lowest = measured
        self._highest = np.maximum(self._highest, measured)
        self._lowest = np.minimum(self._lowest, measured)

    def samples(self) -> tuple[Picture, ...]:
        """Return the copies that were kept, in order."""
        return tuple(self._samples)

    def crop(self, size: tuple[int, int], choice: MatteChoice) -> FlameCrop:
        """Return the part of frames of ``size`` (width, height) to use.

        It is the whole frame if there is no flame. Where light is coverage, glow may reach beyond
        the margin: the box grows until none is seen at its sides. What still is seen there, as
        where the camera cut it off, fades out between the flame and the side.
        """
        box = self.box(size)
        if choice.matte != "luminance":
            return FlameCrop(box)
        light = np.minimum(self._highest[..., 0] / np.float32(255), 1)
        level = min(choice.black.level)
        alpha = as_plane(np.maximum(light - level, 0) / (1 - level))
        alpha[alpha <= choice.black.noise_above] = 0
        box = _grown(box, self._around(size, _MARGIN + _GROWTH), alpha, size)
        lit = [edge > 0 for edge in _edges(box, alpha, size)]
        if not any(lit):
            return FlameCrop(box)
        flame = self._around(size, 0)
        margin = floor(_MARGIN * max(flame.right - flame.left, flame.bottom - flame.top))
        left, top, right, bottom = (
            shows * max(abs(side - inner), margin)
            for side, inner, shows in zip(box, flame, lit, strict=True)
        )
        width, height = box.right - box.left, box.bottom - box.top
        return FlameCrop(box, Fade((left / width, right / width), (top / height, bottom / height)))

    def box(self, size: tuple[int, int]) -> Window:
        """Return the box with a margin, px of frames of ``size`` (width, height).

        The box is the whole frame if there is no flame.
        """
        return self._around(size, _MARGIN)

    def _around(self, size: tuple[int, int], share: float) -> Window:
        """Return the box with a margin of that ``share`` of its longer side."""
        left, top, width, height = cv2.boundingRect(self._flame().view(np.uint8))
        if not width:
            return Window(0, 0, *size)
        rows, columns = self._highest.shape[:2]
        margin = share * max(width / columns * size[0], height / rows * size[1])
        return Window(
            max(0, floor(left * size[0] / columns - margin)),
            max(0, floor(top * size[1] / rows - margin)),
            min(size[0], ceil((left + width) * size[0] / columns + margin)),
            min(size[1], ceil((top + height) * size[1] / rows + margin)),
        )

    def _flame(self) -> NDArray[np.bool_]:
        """Return where flame may be in any of the frames, (h, w)."""
        (shown, coverage), (darkest, least_coverage) = (
            np.moveaxis(extremes, 2, 0) for extremes in (self._highest, self._lowest)
        )
        if least_coverage.min() < 255:
            return np.ascontiguousarray(coverage > 0)
        return (shown - darkest > _MOVES) | (shown > _GLOWS)


def _grown(box: Window, limit: Window, alpha: Plane, size: tuple[int, int]) -> Window:
    """Return ``box``, each side of which grows by 1 px while alpha is seen along it, to a limit."""
    while True:
        seen = [edge > _UNSEEN for edge in _edges(box, alpha, size)]
        steps = (-seen[0], -seen[1], +seen[2], +seen[3])
        larger = Window(*(side + step for side, step in zip(box, steps, strict=True)))
        larger = Window(
            max(larger.left, limit.left), max(larger.top, limit.top),
            min(larger.right, limit.right), min(larger.bottom, limit.bottom),
        )  # fmt: skip
        if larger == box:
            return box
        box = larger


def _edges(box: Window, alpha: Plane, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return the highest alpha along the left, top, right and bottom of a box, px of ``size``.

    ``alpha`` is that of a small copy, (h, w).
    """
    down, across = alpha.shape[0] / size[1], alpha.shape[1] / size[0]
    part = alpha[
        floor(box.top * down) : ceil(box.bottom * down),
        floor(box.left * across) : ceil(box.right * across),
    ]
    return (
        float(part[:, 0].max()), float(part[0].max()),
        float(part[:, -1].max()), float(part[-1].max()),
    )  # fmt: skip


def _brightness_and_coverage(picture: Picture) -> Bytes:
    """Return the brightest channel as sRGB, and the coverage, 0..255, (h, w, 2)."""
    unit = picture.astype(np.float32) / white(picture.dtype)
    shown = encode_unit(brightest(unit)) if picture.dtype == np.float32 else brightest(unit)
    coverage = unit[..., 3] if picture.shape[2] == 4 else np.ones_like(shown)
    return np.dstack([np.rint(255 * shown), np.ceil(255 * coverage)]).astype(np.uint8)


def describe_crop(crop: FlameCrop, size: tuple[int, int]) -> str:
    """Return, for the user, which part of frames of this (width, height) ``crop: auto`` chose."""
    box, fades = crop.box, ""
    if crop.fade is not None:
        shares = zip(("left", "right", "top", "bottom"), (*crop.fade.across, *crop.fade.down),
                     strict=True)  # fmt: skip
        fading = ", ".join(side for side, share in shares if share)
        fades = f"; light that reaches its edges fades out there ({fading})"
    width, height = box.right - box.left, box.bottom - box.top
    spared = 100 * (1 - width * height / (size[0] * size[1]))
    return (
        f"source.crop: [{box.left}, {box.top}, {width}, {height}] holds all flame of the "
        f"{size[0]}x{size[1]} frames ({spared:.0f} % of their area is cut off){fades}"
    )
