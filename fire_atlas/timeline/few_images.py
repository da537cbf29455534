"""Animate a fire of which there are only a few images, down to one: it sways and breathes.

Each frame is an image displaced by eddies that rise through the flame, as hot gas does, the more
the higher, and by a slow stretch along its height. Both have whole numbers of cycles in the clip,
which so closes. Of several images each turns into the next along the optical flow between them.
"""

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.clip import Clip, cached
from fire_atlas.core.noise import PlaneWaves, random_wave_vectors
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.effect.flame.segmentation import FlameSegmentation
from fire_atlas.timeline.retiming import flow_between, interpolated
from fire_atlas.vision.flat_art import is_flat_art
from fire_atlas.vision.flow import resized
from fire_atlas.vision.palette import Palette
from fire_atlas.vision.warp import BidirectionalFlow, blurred, warp_by_pixels

_WAVES, _WAVELENGTHS = 20, (0.3, 1.1)
"""Number of plane waves in the eddies, and their shortest and longest wavelength, flame heights."""

_SWAY = 0.035
"""Displacement (rms) by the eddies at the tip, flame heights."""

_RISE = 1.1
"""Speed at which eddies rise, flame heights/s."""

_STRETCH, _BREATHS = 0.06, (0.8, 1.9)
"""Amplitude of the stretch, and the frequencies of its two waves, Hz."""

_SAMPLES = 32
"""Samples of the eddies per flame height; the displacement is interpolated between them."""

_TIPS = 1.3
"""Height, flame heights, above which the displacement grows no more."""


def animate_images(clip: Clip, count: int, loop: bool, seed: int, workers: Workers) -> Clip:
    """Return a clip of ``count`` frames at the rate of ``clip``, made from its few images.

    Args:
        clip: The images, too few to show motion.
        count: Number of frames of the result.
        loop: Whether the result is a loop. It closes in any case.
        seed: The recipe's seed.
        workers: Read the images.
    """
    images = list(workers.map(clip.read, range(clip.count)))
    planes = list(workers.map(clip.brightness, range(clip.count)))
    flame = FlameSegmentation.estimate(planes, is_opaque=clip.matte == "none")
    burning = as_plane(np.max([flame.fire_of(plane) for plane in planes], axis=0))
    motion = _FlameMotion.of(burning, clip.matte == "none", count / clip.fps, seed)
    palette = None if is_flat_art(clip) else Palette.of(clip, workers)

    @cache
    def flow_from(i: int) -> BidirectionalFlow:
        return flow_between(images[i], images[(i + 1) % len(images)], clip.blend_space)

    def image(time: float) -> Pixels:
        """Return the image at ``time``, 0..1 of the clip, before it is displaced."""
        place = time * len(images)
        before, part = int(place), place - int(place)
        after = (before + 1) % len(images)
        if before == after or palette is None:
            return images[before if part < 0.5 else after]
        part = part * part * (3 - 2 * part)
        return interpolated(images[before], images[after], flow_from(before), part, palette)

    def picture(i: int) -> Pixels:
        how = cv2.INTER_LINEAR if palette else cv2.INTER_NEAREST
        return warp_by_pixels(image(i / count), motion.displacement(i / clip.fps), 1.0, how)

    return replace(clip, count=count, picture=cached(picture, range(count)), loop=loop, flow=None)


@dataclass(frozen=True, slots=True)
class _FlameMotion:
    """Where each pixel of a frame is taken from.

    Attributes:
        foot, height: Lowest row of the flame, and its height, px.
        waves: The eddies' stream function, in px and s.
        breath: (2,) angular frequencies of the stretch, rad/s.
        strength: (H, W), 0..1: how far each pixel follows the motion.
    """

    foot: float
    height: float
    waves: PlaneWaves
    breath: NDArray[np.float64]
    strength: Plane

    @classmethod
    def of(cls, flame: Plane, is_opaque: bool, duration: float, seed: int) -> Self:
        """Return the motion of a flame.

        Args:
            flame: (H, W), 0..1: where the flame is.
            is_opaque: Whether there is a scene behind it, which keeps still.
            duration: After how long the motion repeats, s.
            seed: Random seed.
        """
        rows = np.flatnonzero(flame.max(axis=1) > 0.5)
        top, foot = (rows[0], rows[-1] + 1) if rows.size else (0, len(flame))
        height = float(max(foot - top, 8))
        chance = generator(seed, RandomStream.FEW_IMAGES)
        _, kx, ky = random_wave_vectors(chance, _WAVES, _WAVELENGTHS, height)
        omega = _in_cycles(ky * _RISE * height, duration)
        phase = chance.uniform(0, 2 * np.pi, _WAVES)
        amplitude = _SWAY * height * math.sqrt(2 / _WAVES) / np.hypot(kx, ky)
        waves = PlaneWaves(kx, ky, omega, phase, amplitude)
        breath = _in_cycles(2 * np.pi * np.array(_BREATHS), duration)
        strength = np.ones_like(flame)
        if is_opaque:
            near = cv2.dilate(flame, np.ones((3, 3), np.uint8), iterations=max(1, int(height / 20)))
            strength = blurred(as_plane(near), height / 20)
        return cls(float(foot), height, waves, breath, strength)

    def displacement(self, time: float) -> NDArray[np.float32]:
        """Return where the pixels at ``time`` s come from, relative to them: (H, W, 2) px."""
        rows, columns = self.strength.shape
        step = max(1.0, self.height / _SAMPLES)
        size = max(2, math.ceil(columns / step)), max(2, math.ceil(rows / step))
        x, y = (
            (np.arange(n) + 0.5) * full / n for n, full in zip(size, (columns, rows), strict=True)
        )
        planes = (resized(plane, (columns, rows)) for plane in self.waves.curl(time, x, y))
        above = (self.foot - np.arange(rows, dtype=np.float32)[:, None] - 0.5) / self.height
        above = np.clip(above, 0.0, _TIPS).astype(np.float32)
        # Tallest at the ends of the clip, where it turns: the step between them is a small one.
        stretch = _STRETCH * float(np.cos(self.breath * time) @ (0.6, 0.4))
        taller = above * np.float32(self.height * stretch / (1 + stretch))
        u, v = (plane * above * self.strength for plane in planes)
        return np.dstack([as_plane(u), as_plane(v + taller * self.strength)])


def _in_cycles(omega: NDArray[np.float64], duration: float) -> NDArray[np.float64]:
    """Return angular frequencies, rad/s, of which whole cycles, at least one, fit ``duration``."""
    cycles = np.rint(omega * duration / (2 * np.pi))
    cycles = np.where(cycles == 0, np.where(omega < 0, -1.0, 1.0), cycles)
    return np.asarray(cycles * 2 * np.pi / duration)
