"""Synthesise endless new images of fire from two images of a real fire, the seeds (Appendix B).

The most probable motion between two images is applied to the second; the result replaces the first,
and so on. Done literally, the images blur and freeze after about a dozen. Here the motion is
smoothed and kept as strong as between the seeds, eddies keep it changing, fuel is added from the
seeds (most of it at the base), and lost detail is restored.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.noise import BlurredCurlNoise
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.silk.texture_loop import Image
from fire_atlas.vision.warp import warp_by_pixels

_SIGMA = 0.08
"""σ of eq. 24, relative to the maximum value of the images."""

_WINDOW = 9
"""Side, px, of the window whose pixels are assumed to move alike; a single pixel is ambiguous."""

_DISTANCE_COST = 2e-3
"""Penalty on the exponent of eq. 24 per squared pixel of motion: of equally probable motions the
shortest is chosen."""

_NEW_MOTION = 0.45
"""Weight of the newly estimated motion; the remaining weight is on that between the seeds."""

_EDDIES = 0.3
"""Strength (rms) of the eddies that keep the motion changing, relative to that of the seeds."""

_FUEL_TOP, _FUEL_BASE = 0.3, 0.55
"""Fraction of an image that is replaced by the seeds', at the top and at the base."""

_MAX_SHARPENING = 1.3
"""Maximum factor by which detail is amplified per image."""


def most_probable_motion(one: Image, other: Image, radius: int) -> NDArray[np.float32]:
    """Estimate the motion from ``one`` to ``other``: (height, width, 2) px, x right, y down.

    A pixel of ``other`` may come from any pixel of ``one`` up to ``radius`` px away along each
    axis. Eq. 24 gives the probability, multiplied over the channels and a window of pixels.
    """
    height, width, channels = other.shape
    scale = max(float(one.max()), float(other.max()), 1e-6)
    factor = np.float32(1 / (2 * (_SIGMA * scale) ** 2 * channels))
    padded = cv2.copyMakeBorder(one, radius, radius, radius, radius, cv2.BORDER_REPLICATE)
    padded = padded.reshape(*padded.shape[:2], channels)
    best = np.full((height, width), -np.inf, np.float32)
    motion = np.zeros((height, width, 2), np.float32)
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            moved = padded[radius - dy : radius - dy + height, radius - dx : radius - dx + width]
            error = moved - other
            square = np.einsum("hwc,hwc->hw", error, error)
            exponent = cv2.blur(square, (_WINDOW, _WINDOW)) * -factor
            exponent -= np.float32(_DISTANCE_COST * (dx * dx + dy * dy))
            better = exponent > best
            best = np.where(better, exponent, best)
            motion[better] = dx, dy
    return np.dstack([as_plane(cv2.medianBlur(motion[..., k], 5)) for k in (0, 1)])


@dataclass(frozen=True, slots=True)
class SeedImages:
    """Two images of fire that the synthesis starts from.

    Attributes:
        one, other: (height, width, channels) float32, ``other`` a moment after ``one``.
        radius: Maximum displacement between them along each axis, px.
    """

    one: Image
    other: Image
    radius: int


def synthesise_images(seeds: SeedImages, seed: int, period: int) -> Iterator[Image]:
    """Yield an endless sequence of images that follow the two seeds.

    What drives them repeats after ``period`` images and each image replaces a part of the one
    before, so the images come to repeat as well. From one to the next fire moves as far as between
    the seeds; a sheet that moves faster plays them faster (eq. 17), so its energy is not put into
    the motion as well.

    Args:
        seeds: The two images.
        seed: Seed of the recipe, for the eddies.
        period: Number of images after which they repeat.
    """
    one, other = seeds.one, seeds.other
    height, width = other.shape[:2]
    first = smooth_motion(most_probable_motion(one, other, seeds.radius))
    light = other.max(axis=-1) + np.float32(0.05 * float(other.max()))
    strength = max(_rms(first, light), 0.02 * height / 10)
    seed_step, detail = _distance(one, other), 0.5 * (_detail(one) + _detail(other))
    up = np.linspace(1, 0, height, dtype=np.float32)[:, None, None]
    fuel = np.float32(_FUEL_TOP) + np.float32(_FUEL_BASE - _FUEL_TOP) * (1 - up) ** 2
    chance = generator(seed, RandomStream.EXCITEMENT)
    eddies = BlurredCurlNoise(chance, (height, width), max(height / 14, 1.5), period)
    before, now, correction = one, other, 1.0
    n = 0
    while True:
        found = smooth_motion(most_probable_motion(before, now, seeds.radius))
        motion = np.float32(_NEW_MOTION) * found + np.float32(1 - _NEW_MOTION) * first
        motion = motion * np.float32(strength / max(_rms(motion, light), 1e-6))
        motion = motion + eddies.at(n) * np.float32(_EDDIES * strength)
        moved = _displace(now, motion * np.float32(correction))
        source = _displace(
            one if n % period % 2 else other, eddies.at(n + 0.5) * np.float32(strength)
        )
        new = _sharpen(moved + fuel * (source - moved), detail)
        # Steps that get too small lead to freezing, so the next one is made larger.
        step = _distance(now, new) / max(seed_step, 1e-6)
        correction = float(np.clip(correction * (1 / max(step, 0.1)) ** 0.25, 0.6, 2.5))
        before, now = now, np.clip(new, 0.0, float(max(one.max(), other.max())))
        n += 1
        yield now


def smooth_motion(motion: NDArray[np.float32]) -> NDArray[np.float32]:
    """Blur a motion (height, width, 2) with a Gaussian of σ = 2 px."""
    return as_plane(cv2.GaussianBlur(motion, (0, 0), 2.0))


def _rms(motion: NDArray[np.float32], light: Plane) -> float:
    """Return the root mean square length of the motion, weighted by ``light``."""
    square = np.einsum("hwc,hwc->hw", motion, motion)
    return float(np.sqrt((square * light).sum() / max(float(light.sum()), 1e-9)))


def _distance(one: Image, other: Image) -> float:
    return float(np.sqrt(np.mean((one - other) ** 2)))


def _detail(image: Image) -> float:
    """Return the mean squared gradient, without that of noise in single pixels."""
    image = as_plane(cv2.GaussianBlur(image, (0, 0), 1.0))
    return float(np.mean(np.diff(image, axis=0) ** 2) + np.mean(np.diff(image, axis=1) ** 2))


def _sharpen(image: Image, detail: float) -> Image:
    """Amplify the fine detail of an image until its mean squared gradient is ``detail``."""
    lacking = np.sqrt(detail / max(_detail(image), 1e-12))
    if lacking <= 1:
        return image
    # Only the brightness is sharpened: sharpening each channel would change the colours.
    bright = as_plane(image.max(axis=-1))
    coarse = cv2.GaussianBlur(bright, (0, 0), 2.0)
    gain = np.float32(1.6 * (min(lacking, _MAX_SHARPENING) - 1))
    ratio = 1 + gain * (bright - coarse) / np.maximum(
        bright, np.float32(0.02 * float(bright.max()))
    )
    return np.asarray(image * np.clip(ratio, 0.4, 1.6)[..., None], np.float32)


def _displace(image: Image, motion: NDArray[np.float32]) -> Image:
    """Displace the content of an image by ``motion`` (height, width, 2), px."""
    warped = warp_by_pixels(image, motion, -1.0, cv2.INTER_CUBIC)
    return warped.reshape(image.shape)
