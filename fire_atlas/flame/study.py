"""One look over the whole clip before the work starts: what in it is flame, and how strong.

Everything decided here holds for every frame, so thresholds never flicker.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Window
from fire_atlas.core.pixels import Pixels, Plane, as_plane, brightness
from fire_atlas.core.workers import Workers
from fire_atlas.flame.features import (
    Box,
    difference_of_gaussians,
    feature_vectors,
    gradient,
    kappa,
)
from fire_atlas.recipe.effect import Features

SAMPLES = 12
"""Frames looked at, evenly spread over the clip."""

_FEATURE_SHARE = 0.70
"""Automatic ε: this share of the flame's pixels have weaker gradients."""

_CANDIDATE_SHARE = 0.5
"""Automatic α: this share of the flame's feature vectors are shorter."""

_ACTIVITY_SIDE = 320
"""Longest side, px, of the picture on which neighbourhoods of what moves are drawn."""

_LEAST_EPSILON = 1.0
"""Below this a gradient is the noise of 8-bit quantisation."""


@dataclass(frozen=True, slots=True)
class FlameStudy:
    """What holds for a whole clip.

    Attributes:
        buoyancy: F_buoyancy, a unit vector in image axes.
        box: The flame's box over all frames.
        base: (x, y) of the flame's foot, px.
        dim, bright: Brightness (0..255) that is surely no flame, and surely flame.
        activity: (H, W) float32, 0 where nothing ever moves to 1 where much does.
        warm_only: Whether only warm colours can be flame (opaque scenes).
        kappa: (H, W) float32, κ of each pixel.
        epsilon: ε in force.
        alpha: Automatic α.
        candidates: Mean candidates a frame at the automatic α.
        typical: Mean ‖Fv‖ over features, the unit of the feature force.
    """

    buoyancy: tuple[float, float]
    box: Box
    base: tuple[float, float]
    dim: float
    bright: float
    activity: Plane
    warm_only: bool
    kappa: Plane
    epsilon: float
    alpha: float
    candidates: float
    typical: float

    def active_window(self, step: int) -> Window:
        """Return the part of the frame where anything ever moves, on multiples of ``step`` px."""
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

    def within(self, window: Window) -> "FlameStudy":
        """Return what holds for the part of the clip in ``window``."""
        return replace(self, activity=self.activity[window.slices], kappa=self.kappa[window.slices])


def study_flame(
    clip: Clip, features: Features, buoyancy: tuple[float, float], workers: Workers
) -> FlameStudy:
    """Look at a few frames of ``clip`` and decide what the whole build stands on.

    ``buoyancy`` is F_buoyancy, a unit vector in image axes, along which κ grows.
    """
    picks = sorted({round(i) for i in np.linspace(0, clip.count - 1, SAMPLES)})
    frames = list(workers.map(lambda i: _Look.at(clip.read(i), clip.blend_space), picks))
    warm_only = clip.matte == "none"
    dim, bright = _flame_levels(frames, warm_only)
    activity = _activity([look.brightness for look in frames])
    masks = [
        flame_mask(
            above(look.brightness, dim, bright), look.warmth if warm_only else None, activity
        )
        for look in frames
    ]
    box, base = _flame_box(masks)
    spanned = box if features.kappa_over == "flame" else Box(0, 0, clip.width - 1, clip.height - 1)
    weight = kappa((clip.height, clip.width), spanned, buoyancy, features.n)
    epsilon = features.epsilon
    if epsilon == "auto":
        epsilon = _automatic_epsilon(frames, masks, features.sigma)
    lengths = [
        as_plane(
            cv2.magnitude(*feature_vectors(look.brightness, features.sigma, epsilon, weight)) * mask
        )
        for look, mask in zip(frames, masks, strict=True)
    ]
    alpha, candidates, typical = _automatic_alpha(lengths)
    return FlameStudy(
        buoyancy, box, base, dim, bright, activity, warm_only, weight, epsilon, alpha, candidates,
        typical,
    )  # fmt: skip


def above(bright_plane: Plane, dim: float, bright: float) -> Plane:
    """How bright each pixel is, (H, W) in 0..1: 0 up to ``dim``, 1 from ``bright`` on."""
    return as_plane(np.clip((bright_plane - dim) / (bright - dim), 0.0, 1.0))


def flame_mask(luminous: Plane, warm: Plane | None, activity: Plane) -> Plane:
    """How surely each pixel is flame, (H, W) in 0..1: luminous, moving and (if asked) warm.

    Args:
        luminous: ``above`` of the frame.
        warm: ``warmth`` of the frame, or None where colour does not tell.
        activity: Plane of ``FlameStudy``.
    """
    mask = luminous * activity
    return mask if warm is None else mask * warm


def warmth(pixels: Pixels) -> Plane:
    """How fire-like the colour of each pixel is, (H, W) in 0..1: red above blue, or white-hot."""
    red, blue = pixels[..., 0], pixels[..., 2]
    fire_like = np.maximum((red - blue) / (red + 1e-4) * 2.0 - 0.3, red - 0.7)
    return as_plane(np.clip(fire_like, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class _Look:
    brightness: Plane
    warmth: Plane

    @classmethod
    def at(cls, pixels: Pixels, blend_space: str) -> "_Look":
        return cls(brightness(pixels, blend_space), warmth(pixels))


def _flame_levels(frames: list[_Look], scene: bool) -> tuple[float, float]:
    """Levels that part flame from the dark (Otsu over the lit pixels), or from a lit scene."""
    lit = np.concatenate([look.brightness[look.brightness > 6].ravel()[::7] for look in frames])
    if lit.size == 0:
        return 20.0, 60.0
    otsu, _ = cv2.threshold(lit.astype(np.uint8), 0, 255, cv2.THRESH_OTSU)
    if scene:
        return 0.75 * otsu, 1.25 * otsu + 1.0
    return min(0.25 * otsu, 24.0), max(min(0.6 * otsu, 70.0), 2.0)


def _activity(planes: list[Plane]) -> Plane:
    """How much each place changes over the clip, with its neighbourhood; a still moves anywhere.

    A prop lit by the fire flickers by a part of its brightness; where flame comes and goes it
    changes by most of it, and nothing is brighter. The core of a steady flame does not change at
    all: it is surrounded.
    """
    if len(planes) == 1:
        return np.ones_like(planes[0])
    peak = np.maximum.reduce(planes)
    spread = peak - np.minimum.reduce(planes)
    comes_and_goes = np.clip((spread / (peak + 10.0) - 0.25) / 0.25, 0.0, 1.0)
    brightest = np.clip(peak / max(float(np.quantile(peak, 0.995)), 1.0) * 4.0 - 2.8, 0.0, 1.0)
    changes = np.clip((spread - 8.0) / 24.0, 0.0, 1.0)
    moves = as_plane(changes * np.maximum(comes_and_goes, brightest))
    height, width = spread.shape
    scale = min(1.0, _ACTIVITY_SIDE / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    small = cv2.resize(moves, size, interpolation=cv2.INTER_AREA)
    near, core = _disc(size[1] * 0.012), _disc(size[1] * 0.05)
    filled = cv2.morphologyEx(cv2.dilate(small, near), cv2.MORPH_CLOSE, core)
    soft = cv2.blur(filled, near.shape)
    return as_plane(cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR))


def _disc(radius: float) -> NDArray[np.uint8]:
    side = 2 * max(1, round(radius)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)).astype(np.uint8)


def _flame_box(masks: list[Plane]) -> tuple[Box, tuple[float, float]]:
    """Box that holds the flame, but for stray pixels, and the (x, y) of the flame's foot."""
    height, width = masks[0].shape
    total = np.add.reduce(masks)
    if not total.any():
        return Box(0.0, 0.0, width - 1.0, height - 1.0), (width / 2, float(height))
    (left, right), (top, bottom) = (_extent(total.sum(axis=axis)) for axis in (0, 1))
    foot = total[max(0, int(bottom - (bottom - top) * 0.15)) : int(bottom) + 1].sum(axis=0)
    x = float((foot * (np.arange(width) + 0.5)).sum() / max(foot.sum(), 1e-6))
    return Box(left, top, right, bottom), (x, bottom + 1.0)


def _extent(profile: Plane) -> tuple[float, float]:
    """First and last index between which all but 1 % of ``profile`` lies."""
    total = np.cumsum(profile, dtype=np.float64)
    first, last = np.searchsorted(total, total[-1] * np.array([0.005, 0.995]))
    return float(first), float(last)


def _automatic_epsilon(
    frames: list[_Look], masks: list[Plane], sigma: tuple[float, float]
) -> float:
    slopes = (
        as_plane(cv2.magnitude(*gradient(difference_of_gaussians(look.brightness, sigma))))[
            mask > 0.5
        ]
        for look, mask in zip(frames, masks, strict=True)
    )
    return max(_quantile(slopes, _FEATURE_SHARE), _LEAST_EPSILON)


def _automatic_alpha(lengths: list[Plane]) -> tuple[float, float, float]:
    """Automatic α, the mean number of candidates it gives, and the mean length of a feature."""
    features = np.concatenate([plane[plane > 0] for plane in lengths])
    if features.size == 0:
        return 0.0, 1.0, 1.0
    alpha = float(np.quantile(features, _CANDIDATE_SHARE))
    count = float(np.count_nonzero(features > alpha)) / len(lengths)
    return alpha, max(count, 1.0), float(features.mean())


def _quantile(parts: Iterable[NDArray[np.float32]], share: float) -> float:
    values = np.concatenate(list(parts))
    return float(np.quantile(values, share)) if values.size else 0.0
