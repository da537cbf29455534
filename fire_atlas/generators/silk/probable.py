"""New images of fire without end, from two of a real one (Appendix B).

The most probable motion between two images moves the second on; the result takes the place of the
first, and so forth. Taken literally this freezes after a dozen images and blurs away: here motion
is smoothed and held to the strength it had between the seeds, eddies keep it changing, fuel comes
back from the seeds, above all at the base, and what is lost in detail is restored.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.core.pixels import Plane, as_plane

Images = NDArray[np.float32]
"""(height, width, channels) float32."""

_SIGMA = 0.08
"""[σ] of eq. 24, against the brightest value."""

_POOLED = 9
"""Side of the window, px, whose pixels are taken to move alike: one pixel alone says too little."""

_LAZY = 2e-3
"""How much less probable each squared px of motion is, in units of the exponent: of moves that
explain a place equally well the shortest counts."""

_KEPT = 0.45
"""Share of the newly found motion; the rest is that between the seeds, which cannot die out."""

_EDDIES = 0.3
"""Strength (rms) of the eddies that keep motion changing, against that between the seeds."""

_FUEL = 0.3, 0.55
"""Share of an image that comes back from the seeds, at the top and at the base."""

_MOST_DETAIL = 1.8
"""Most by which detail is strengthened in one step."""


def probable_motion(one: Images, other: Images, reach: int) -> NDArray[np.float32]:
    """The most probable motion from ``one`` to ``other``, px right and down (height, width, 2).

    For each pixel of ``other``, each of those of ``one`` up to ``reach`` px away may have moved
    there; eq. 24 says how probably, multiplied over the channels, and over a window around it.
    """
    height, width, channels = other.shape
    scale = max(float(one.max()), float(other.max()), 1e-6)
    worth = np.float32(1 / (2 * (_SIGMA * scale) ** 2 * channels))
    padded = cv2.copyMakeBorder(one, reach, reach, reach, reach, cv2.BORDER_REPLICATE)
    padded = padded.reshape(*padded.shape[:2], channels)
    best = np.full((height, width), -np.inf, np.float32)
    motion = np.zeros((height, width, 2), np.float32)
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            moved = padded[reach - dy : reach - dy + height, reach - dx : reach - dx + width]
            error = moved - other
            square = np.einsum("hwc,hwc->hw", error, error)
            likely = cv2.blur(square, (_POOLED, _POOLED)) * -worth
            likely -= np.float32(_LAZY * (dx * dx + dy * dy))
            better = likely > best
            best = np.where(better, likely, best)
            motion[better] = dx, dy
    return np.dstack([as_plane(cv2.medianBlur(motion[..., k], 5)) for k in (0, 1)])


@dataclass(frozen=True, slots=True)
class Seeds:
    """Two images of fire to go on from.

    Attributes:
        one, other: (height, width, channels) float32, ``other`` a moment after ``one``.
        reach: Furthest that anything moves between them, px.
    """

    one: Images
    other: Images
    reach: int


def synthesise(seeds: Seeds, seed: int, energy: float = 1.0) -> Iterator[Images]:
    """Images that follow the two seeds, without end.

    Args:
        seeds: Where they come from.
        seed: Of the build, for the eddies.
        energy: v_rms² of the sheets against that at which the fire moves as between the seeds; its
            root scales the motion.
    """
    one, other = seeds.one, seeds.other
    height, width = other.shape[:2]
    first = _smooth(probable_motion(one, other, seeds.reach))
    light = other.max(axis=-1) + np.float32(0.05 * float(other.max()))
    strength = max(_rms(first, light), 0.02 * height / 10)
    gain = float(np.sqrt(energy))
    usual_step, detail = _distance(one, other), 0.5 * (_detail(one) + _detail(other))
    up = np.linspace(1, 0, height, dtype=np.float32)[:, None, None]
    eddies = _Eddies(seed, height, width)
    before, now, urge = one, other, 1.0
    n = 0
    while True:
        found = _smooth(probable_motion(before, now, seeds.reach))
        motion = np.float32(_KEPT) * found + np.float32(1 - _KEPT) * first
        motion = motion * np.float32(strength / max(_rms(motion, light), 1e-6))
        motion = (motion + eddies.at(n) * np.float32(_EDDIES * strength)) * np.float32(gain * urge)
        moved = _moved(now, motion)
        source = _moved(one if n % 2 else other, eddies.at(n + 0.5) * np.float32(strength))
        fuel = np.float32(_FUEL[0]) + np.float32(_FUEL[1] - _FUEL[0]) * (1 - up) ** 2
        new = _detailed(moved + fuel * (source - moved), detail)
        # Too small a step is the beginning of the end: the next one is urged on.
        step = _distance(now, new) / max(usual_step, 1e-6)
        urge = float(np.clip(urge * (gain / max(step, 0.1)) ** 0.25, 0.6, 2.5))
        before, now = now, np.clip(new, 0.0, float(max(one.max(), other.max())))
        n += 1
        yield now


class _Eddies:
    """Smooth motion without sources, of rms 1, that changes from image to image."""

    def __init__(self, seed: int, height: int, width: int) -> None:
        chance = generator(seed, Stage.EXCITEMENT)
        self._noise = chance.normal(0, 1, (4, height, width)).astype(np.float32)
        self._turn = chance.uniform(0.10, 0.35, 2)
        self._blur = max(height / 14, 1.5)

    def at(self, n: float) -> NDArray[np.float32]:
        a, b = (2 * np.pi * turn * n for turn in self._turn)
        weights = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
        stream = sum(np.float32(w) * noise for w, noise in zip(weights, self._noise, strict=True))
        stream = cv2.GaussianBlur(np.asarray(stream, np.float32), (0, 0), self._blur)
        motion = np.dstack(
            [cv2.Sobel(stream, cv2.CV_32F, 0, 1), -cv2.Sobel(stream, cv2.CV_32F, 1, 0)]
        )
        return as_plane(motion / max(float(np.sqrt((motion**2).sum(axis=-1).mean())), 1e-9))


def _smooth(motion: NDArray[np.float32]) -> NDArray[np.float32]:
    return as_plane(cv2.GaussianBlur(motion, (0, 0), 2.0))


def _rms(motion: NDArray[np.float32], light: Plane) -> float:
    """Root mean square length of the motion of what shines."""
    square = np.einsum("hwc,hwc->hw", motion, motion)
    return float(np.sqrt((square * light).sum() / max(float(light.sum()), 1e-9)))


def _distance(one: Images, other: Images) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2)))


def _detail(image: Images) -> float:
    """Mean squared gradient."""
    return float(np.mean(np.diff(image, axis=0) ** 2) + np.mean(np.diff(image, axis=1) ** 2))


def _detailed(image: Images, wanted: float) -> Images:
    """``image`` with its fine detail strengthened until its gradients are as ``wanted``."""
    lacking = np.sqrt(wanted / max(_detail(image), 1e-12))
    if lacking <= 1:
        return image
    # Of the brightness alone: strengthened channel by channel, fire would turn into rainbows.
    bright = as_plane(image.max(axis=-1))
    coarse = cv2.GaussianBlur(bright, (0, 0), 2.0)
    gain = np.float32(1.6 * (min(lacking, _MOST_DETAIL) - 1))
    ratio = 1 + gain * (bright - coarse) / np.maximum(
        bright, np.float32(0.02 * float(bright.max()))
    )
    return np.asarray(image * np.clip(ratio, 0.4, 1.6)[..., None], np.float32)


def _moved(image: Images, motion: NDArray[np.float32]) -> Images:
    height, width = image.shape[:2]
    columns = np.arange(width, dtype=np.float32)[None] - motion[..., 0]
    rows = np.arange(height, dtype=np.float32)[:, None] - motion[..., 1]
    moved = cv2.remap(image, columns, rows, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return as_plane(moved).reshape(image.shape)
