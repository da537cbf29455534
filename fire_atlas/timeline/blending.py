"""One frame of a seam, made of one frame of each side."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Pixels, Plane, as_plane, luminance
from fire_atlas.vision.thumbnails import detail_energy, gradient_product
from fire_atlas.vision.warp import Field, both_warped, resized

_FINE = 1.0
"""Detail that warping blurs, px."""

_SHARPEST = 0.5
"""Most that is added of it."""

_FAINT = 1e-4
"""Light that is below what 8 bits show."""


@dataclass(frozen=True, slots=True)
class Blend:
    """How one frame of a seam is made of one frame of each side.

    Attributes:
        warps: Fields that warp both sides to where they meet.
        share: (h, w), how much of the second side each place takes, 0..1.
        gain: (h, w), by how much the mix must deviate more from the mean, to keep its contrast.
    """

    warps: tuple[Field, Field]
    share: Plane
    gain: Plane

    def of(self, ending: Pixels, beginning: Pixels, mean: Pixels) -> Pixels:
        """Return the frame, (H, W, 4); ``mean``, of the clip, may be small."""
        size = ending.shape[1], ending.shape[0]
        one, other = both_warped((ending, beginning), self.warps)
        share, gain = resized(self.share, size), resized(self.gain, size)
        mixed = as_plane(one + (other - one) * share[..., None])
        around = resized(mean, size)
        hue = _ember_mix(one, other, share)
        light = [luminance(frame) for frame in (mixed, around, one, other)]
        cover = [as_plane(cv2.extractChannel(frame, 3)) for frame in (mixed, around, one, other)]
        brighter, covered = _stretched(light, gain), _stretched(cover, gain)
        # All colours get the same factor, so that no hue changes; it stops where the strongest
        # would have more light than its coverage allows.
        floor = np.float32(_FAINT)
        factor = brighter / np.maximum(luminance(hue), floor)
        most = np.maximum(covered, brightest(mixed))
        factor = np.minimum(factor, most / np.maximum(brightest(hue), floor))
        hue[..., :3] *= factor[..., None]
        hue[..., 3] = covered
        part = float(self.share.mean())
        wanted = (1 - part) * detail_energy(ending) + part * detail_energy(beginning)
        return _sharpened(hue, wanted)


def _sharpened(pixels: Pixels, energy: float) -> Pixels:
    """Return ``pixels`` with as much detail as ``energy`` says, if warping has blurred them.

    Of detail d the frame gets a·d: ‖∇f‖² + 2a ∇f·∇d + a² ‖∇d‖² = ``energy``.
    """
    fine = as_plane(pixels - cv2.GaussianBlur(pixels, (0, 0), _FINE))
    light, extra = luminance(pixels), luminance(fine)
    own, cross, more = (
        gradient_product(light, light),
        gradient_product(light, extra),
        gradient_product(extra, extra),
    )
    if own >= energy or more <= 0:
        return pixels
    amount = (math.sqrt(cross**2 + more * (energy - own)) - cross) / more
    sharp = pixels[..., :3] + fine[..., :3] * np.float32(min(amount, _SHARPEST))
    most = np.maximum(pixels[..., 3], brightest(pixels))
    np.clip(sharp, 0, most[..., None], out=pixels[..., :3])
    return pixels


def _ember_mix(one: Pixels, other: Pixels, share: Plane) -> Pixels:
    """Return a mix whose hues are those of fire: the fourth root of light is mixed.

    Half-way from white-hot to dark fire is orange; the mean of their light is grey.
    """
    here, there = (as_plane(cv2.sqrt(cv2.sqrt(side))) for side in (one, other))
    mixed = here + (there - here) * share[..., None]
    return as_plane(np.square(np.square(mixed)))


def _stretched(planes: Sequence[Plane], gain: Plane) -> Plane:
    """Deviate ``gain`` times more from the mean than the mix does, as far as either side does.

    ``planes``: the mix, the mean and both sides.
    """
    mixed, mean, one, other = planes
    least, most = np.minimum(one, other), np.maximum(one, other)
    return as_plane(np.clip(mean + gain * (mixed - mean), least, most))
