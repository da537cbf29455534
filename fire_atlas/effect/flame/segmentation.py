"""Segmentation: find the flame's pixels, with the same thresholds in all frames of a clip."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.vision.activity import activity, flicker, mean_of
from fire_atlas.vision.flow import resized

_OUTLINE_SIDE, _OUTLINE_GAP = 128, 0.2
"""Longest side, px, of the copy on which the outline of a flame is closed, and the widest white
core that it encloses, as a part of the picture's height."""


@dataclass(frozen=True, slots=True)
class Background:
    """The static scene behind the flame of an opaque clip; the flame's light makes it flicker.

    Attributes:
        mean: (H, W) mean brightness over time, 0..255.
        lowest: (H, W) lowest brightness over time, after the flicker is divided out.
        flame_level: Brightness that only flame reaches: 99.5th percentile of the brightest frames.
    """

    mean: Plane
    lowest: Plane
    flame_level: float

    @classmethod
    def estimate(cls, planes: list[Plane]) -> "Background":
        """Estimate the background from the brightness (H, W), 0..255, of a few frames."""
        mean = mean_of(planes)
        steady = (plane / max(flicker(plane, mean), np.float32(0.1)) for plane in planes)
        lowest: Plane = reduce(np.minimum, steady)
        highest: Plane = reduce(np.maximum, planes)
        return cls(mean, lowest, max(float(np.quantile(highest, 0.995)), 1.0))

    def cropped(self, window: Window) -> "Background":
        """Return the background in a window of the frame."""
        return replace(self, mean=self.mean[window.slices], lowest=self.lowest[window.slices])

    def resized(self, size: tuple[int, int]) -> "Background":
        """Return the background of frames resized to ``size`` (width, height)."""
        return replace(self, mean=resized(self.mean, size), lowest=resized(self.lowest, size))

    def foreground(self, brightness: Plane, pixels: Pixels) -> Plane:
        """Confidence (H, W), 0..1, that each pixel of a frame is flame, by colour and brightness.

        Flame has a warm colour and is brighter than the background in the frame's light. Where a
        pixel is always flame its background is unknown; its lowest brightness is then flame's.
        """
        lit_background = self.lowest * flicker(brightness, self.mean)
        stands_out = linear_step(as_plane(brightness - lit_background), 12.0, 40.0)
        core = linear_step(self.lowest, 0.8 * self.flame_level, self.flame_level)
        return warmth(pixels) * np.maximum(stands_out, core)


@dataclass(frozen=True, slots=True)
class FlameSegmentation:
    """Thresholds and maps that separate flame from all else, the same for every frame of a clip.

    Attributes:
        dim, bright: Brightness, 0..255: to ``dim`` a pixel is dark, from ``bright`` on bright.
        activity: (H, W) float32, from 0 where nothing ever moves to 1 where much does.
        background: The scene behind the flame of an opaque clip, else None.
    """

    dim: float
    bright: float
    activity: Plane
    background: Background | None

    @classmethod
    def estimate(cls, planes: list[Plane], is_opaque: bool) -> "FlameSegmentation":
        """Estimate the segmentation of a clip from the brightness (H, W), 0..255, of a few frames.

        A clip that ``is_opaque`` has no matte: its flame must be separated from a scene.
        """
        dim, bright = _thresholds(planes, is_opaque)
        background = Background.estimate(planes) if is_opaque and len(planes) > 1 else None
        return cls(dim, bright, activity(planes), background)

    def mask(self, brightness: Plane, pixels: Callable[[], Pixels]) -> Plane:
        """Confidence (H, W), 0..1, that each pixel of a frame is flame: luminous and moving.

        ``pixels`` reads the frame; it is called only if there is a background to separate.
        """
        mask = self.fire_of(brightness) * self.activity
        if self.background is None:
            return mask
        return mask * self.background.foreground(brightness, pixels())

    def fire_before(self, brightness: Plane, pixels: Pixels) -> Plane:
        """How much of each pixel of a frame is flame before a scene, (H, W) in 0..1.

        Where fire burns in every frame the background is unknown: there all that is warm and bright
        is flame.
        """
        burning = self.activity * self.fire_of(brightness) * warmth(pixels)
        if self.background is None:
            return as_plane(burning)
        return as_plane(np.maximum(self.background.foreground(brightness, pixels), burning))

    def fire_of(self, brightness: Plane) -> Plane:
        """How bright each pixel of a frame is, (H, W) in 0..1, flame or not."""
        return linear_step(brightness, self.dim, self.bright)

    def active_window(self, step: int) -> Window:
        """Return the window in which anything ever moves, its edges on multiples of ``step`` px."""
        height, width = self.activity.shape
        moving = self.activity > 0
        rows, columns = np.flatnonzero(moving.any(axis=1)), np.flatnonzero(moving.any(axis=0))
        if not rows.size:
            return Window(0, 0, width, height)
        margin = max(8, height // 50)

        def bounds(places: NDArray[np.intp], end: int) -> tuple[int, int]:
            first = max(int(places[0]) - margin, 0) // step * step
            last = -(-(int(places[-1]) + 1 + margin) // step) * step
            return first, min(last, end)

        (top, bottom), (left, right) = bounds(rows, height), bounds(columns, width)
        return Window(left, top, right, bottom)

    def cropped(self, window: Window) -> "FlameSegmentation":
        """Return the segmentation in a window of the frame."""
        background = self.background.cropped(window) if self.background is not None else None
        return replace(self, activity=self.activity[window.slices], background=background)

    def resized(self, size: tuple[int, int]) -> "FlameSegmentation":
        """Return the segmentation of frames resized to ``size`` (width, height)."""
        background = self.background.resized(size) if self.background is not None else None
        return replace(self, activity=resized(self.activity, size), background=background)


def linear_step(plane: Plane, low: float, high: float) -> Plane:
    """Ramp (H, W) from 0 where a plane is at most ``low`` to 1 where it is at least ``high``."""
    return as_plane(np.clip((plane - low) / (high - low), 0.0, 1.0))


def warmth(pixels: Pixels) -> Plane:
    """How fire-like the colour of each pixel is, (H, W) in 0..1: red above blue, or white-hot.

    Clouds, bright smoke and windows are as white as the hottest flame, but only flame is white
    within an outline of warm colours.
    """
    red, blue = pixels[..., 0], pixels[..., 2]
    warm = as_plane(np.clip((red - blue) / (red + 1e-4) * 2.0 - 0.3, 0.0, 1.0))
    white = np.clip(red - 0.7, 0.0, 1.0)
    if not white.any():
        return warm
    height, width = warm.shape
    scale = min(1.0, _OUTLINE_SIDE / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = cv2.convertScaleAbs(resized(warm, size), alpha=255)
    side = 2 * max(1, round(_OUTLINE_GAP * size[1] / 2)) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    within = resized(as_plane(cv2.morphologyEx(small, cv2.MORPH_CLOSE, disc)), (width, height))
    return as_plane(np.maximum(warm, white * within / np.float32(255)))


def _thresholds(planes: list[Plane], is_opaque: bool) -> tuple[float, float]:
    """``dim`` and ``bright`` around Otsu's threshold of pixels above 6; narrower if opaque."""
    values = np.concatenate([plane[plane > 6].ravel()[::7] for plane in planes])
    if values.size == 0:
        return 20.0, 60.0
    otsu, _ = cv2.threshold(values.astype(np.uint8), 0, 255, cv2.THRESH_OTSU)
    if is_opaque:
        return 0.75 * otsu, 1.25 * otsu + 1.0
    return min(0.25 * otsu, 24.0), max(min(0.6 * otsu, 70.0), 2.0)
