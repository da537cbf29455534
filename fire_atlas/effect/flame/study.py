"""One look over the whole clip before the work starts: what in it is flame, and how strong.

Everything decided here holds for every frame, so thresholds never flicker.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial, reduce

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Window
from fire_atlas.core.pixels import Pixels, Plane
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flame.features import (
    Box,
    kappa,
    slope_of,
)
from fire_atlas.effect.flame.scene import Scene, above
from fire_atlas.recipe.effect import Features
from fire_atlas.vision.activity import activity

_FEWEST, _MOST = 6, 12
"""Frames looked at, evenly spread over the clip: every other one of a short clip, for neighbours
tell much the same."""

_FEATURE_SHARE = 0.70
"""Automatic ε: this share of the flame's pixels have weaker gradients."""

_CANDIDATE_SHARE = 0.5
"""Automatic α: this share of the flame's feature vectors are shorter."""

_NOTHING = 0.02
"""Of a fire that gives less than this share of its usual light, next to nothing is left."""

_LEAST_EPSILON = 1.0
"""Below this a gradient is the noise of 8-bit quantisation."""


@dataclass(frozen=True, slots=True)
class FlameMask:
    """What tells flame from all else, the same in every frame.

    Attributes:
        dim, bright: Brightness (0..255) that is surely no flame, and surely flame.
        activity: (H, W) float32, 0 where nothing ever moves to 1 where much does.
        scene: What stands still behind the flame, where the clip is an opaque scene.
    """

    dim: float
    bright: float
    activity: Plane
    scene: Scene | None

    def of(self, shown: Plane, pixels: Callable[[], Pixels]) -> Plane:
        """How surely each pixel of a frame is flame, (H, W) in 0..1: luminous and moving.

        Args:
            shown: Brightness of the frame.
            pixels: Gives the frame; asked only where colours tell flame from what it lights.
        """
        mask = self.lit(shown) * self.activity
        return mask if self.scene is None else mask * self.scene.flame(shown, pixels())

    def lit(self, shown: Plane) -> Plane:
        """How bright each pixel of a frame is, (H, W) in 0..1, flame or not."""
        return above(shown, self.dim, self.bright)

    def within(self, window: Window) -> "FlameMask":
        """Return the same for a part of the frame."""
        scene = self.scene.within(window) if self.scene is not None else None
        return replace(self, activity=self.activity[window.slices], scene=scene)


@dataclass(frozen=True, slots=True)
class FlameStudy:
    """What holds for a whole clip.

    Attributes:
        buoyancy: F_buoyancy, a unit vector in image axes.
        box: The flame's box over all frames.
        base: (x, y) of the flame's foot, px.
        extent: Area of the box in which fire moves, heights².
        mask: What tells flame from all else.
        kappa: (H, W) float32, κ of each pixel.
        epsilon: ε in force.
        alpha: Automatic α.
        candidates: Mean candidates a frame at the automatic α.
        typical: Mean ‖Fv‖ over features, the unit of the feature force.
        burns_out: Whether next to nothing of the flame is left in the last frame.
    """

    buoyancy: tuple[float, float]
    box: Box
    base: tuple[float, float]
    extent: float
    mask: FlameMask
    kappa: Plane
    epsilon: float
    alpha: float
    candidates: float
    typical: float
    burns_out: bool

    def active_window(self, step: int) -> Window:
        """Return the part of the frame where anything ever moves, on multiples of ``step`` px."""
        height, width = self.kappa.shape
        moving = self.mask.activity > 0
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
        return replace(self, mask=self.mask.within(window), kappa=self.kappa[window.slices])


def study_flame(
    clip: Clip, features: Features, buoyancy: tuple[float, float], workers: Workers
) -> FlameStudy:
    """Look at a few frames of ``clip`` and decide what the whole build stands on.

    ``buoyancy`` is F_buoyancy, a unit vector in image axes, along which κ grows.
    """
    samples = min(max(clip.body // 2, _FEWEST), _MOST)
    picks = sorted({round(i) for i in np.linspace(0, clip.body - 1, samples)})
    shown = list(workers.map(clip.brightness, picks))
    # Not needed before the masks: made beside what only one thread can do.
    started = [workers.start(partial(slope_of, plane, features.sigma)) for plane in shown]
    tells = _flame_mask(shown, is_scene=clip.matte == "none")
    looks = zip(picks, shown, strict=True)
    masks = list(workers.map(lambda look: tells.of(look[1], partial(clip.read, look[0])), looks))
    box, base = _flame_box(masks)
    spanned = box if features.kappa_over == "flame" else Box(0, 0, clip.width - 1, clip.height - 1)
    weight = kappa((clip.height, clip.width), spanned, buoyancy, features.n)
    pairs = [(slope.result(), mask) for slope, mask in zip(started, masks, strict=True)]
    epsilon = _automatic_epsilon(pairs, workers) if features.epsilon == "auto" else features.epsilon
    lengths = workers.map(lambda pair: _lengths(*pair, weight, epsilon), pairs)
    alpha, candidates, typical = _automatic_alpha(list(lengths))
    return FlameStudy(
        buoyancy, box, base, _extent(tells.activity, box), tells, weight, epsilon, alpha,
        candidates, typical, _burns_out(shown, masks),
    )  # fmt: skip


def _flame_mask(shown: list[Plane], is_scene: bool) -> FlameMask:
    dim, bright = _flame_levels(shown, is_scene)
    scene = Scene.behind(shown) if is_scene and len(shown) > 1 else None
    return FlameMask(dim, bright, activity(shown), scene)


def _flame_levels(shown: list[Plane], is_scene: bool) -> tuple[float, float]:
    """Levels that part flame from the dark (Otsu over the lit pixels), or from a lit scene."""
    lit = np.concatenate([plane[plane > 6].ravel()[::7] for plane in shown])
    if lit.size == 0:
        return 20.0, 60.0
    otsu, _ = cv2.threshold(lit.astype(np.uint8), 0, 255, cv2.THRESH_OTSU)
    if is_scene:
        return 0.75 * otsu, 1.25 * otsu + 1.0
    return min(0.25 * otsu, 24.0), max(min(0.6 * otsu, 70.0), 2.0)


def _flame_box(masks: list[Plane]) -> tuple[Box, tuple[float, float]]:
    """Box that holds the flame, but for stray pixels, and the (x, y) of the flame's foot."""
    height, width = masks[0].shape
    total: Plane = reduce(np.add, masks)
    if not total.any():
        return Box(0.0, 0.0, width - 1.0, height - 1.0), (width / 2, float(height))
    (left, right), (top, bottom) = (_span(total.sum(axis=axis)) for axis in (0, 1))
    foot = total[max(0, int(bottom - (bottom - top) * 0.15)) : int(bottom) + 1].sum(axis=0)
    x = float((foot * (np.arange(width) + 0.5)).sum() / max(foot.sum(), 1e-6))
    return Box(left, top, right, bottom), (x, bottom + 1.0)


def _extent(activity: Plane, box: Box) -> float:
    """Area of the box, heights², in which anything moves."""
    inside = activity[int(box.top) : int(box.bottom) + 1, int(box.left) : int(box.right) + 1]
    return float(inside.sum()) / len(activity) ** 2


def _burns_out(shown: list[Plane], masks: list[Plane]) -> bool:
    """Whether the light of the flame, about the square of its brightness, fades to nothing."""
    light = [float((mask * plane * plane).sum()) for plane, mask in zip(shown, masks, strict=True)]
    burning = [each for each in light if each > 0]
    return bool(burning) and light[-1] < _NOTHING * float(np.median(burning))


def _span(profile: Plane) -> tuple[float, float]:
    """First and last index between which all but 1 % of ``profile`` lies."""
    total = np.cumsum(profile, dtype=np.float64)
    first, last = np.searchsorted(total, total[-1] * np.array([0.005, 0.995]))
    return float(first), float(last)


def _automatic_epsilon(pairs: list[tuple[Plane, Plane]], workers: Workers) -> float:
    """Automatic ε of the slopes and masks of a few frames."""
    inside = np.concatenate(list(workers.map(lambda pair: pair[0][pair[1] > 0.5], pairs)))
    if not inside.size:
        return _LEAST_EPSILON
    return max(float(np.quantile(inside, _FEATURE_SHARE)), _LEAST_EPSILON)


def _lengths(slope: Plane, mask: Plane, kappa: Plane, epsilon: float) -> NDArray[np.float32]:
    """‖Fv‖ of the pixels of a frame that have any."""
    places = np.flatnonzero((slope > epsilon) & (mask > 0) & (kappa > 0))
    return slope.ravel()[places] * kappa.ravel()[places] * mask.ravel()[places]


def _automatic_alpha(lengths: list[NDArray[np.float32]]) -> tuple[float, float, float]:
    """Automatic α, the mean number of candidates it gives, and the mean length of a feature."""
    features = np.concatenate(lengths)
    if features.size == 0:
        return 0.0, 1.0, 1.0
    alpha = float(np.quantile(features, _CANDIDATE_SHARE))
    count = float(np.count_nonzero(features > alpha)) / len(lengths)
    return alpha, max(count, 1.0), float(features.mean())
