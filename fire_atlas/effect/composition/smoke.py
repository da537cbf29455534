"""Split smoke off a picture: what hides without shining, as a grey layer under the fire's light.

A client shows P + (1 − A) B of a pixel over a background B, where P is its light as the client adds
it and A its coverage. Split into smoke, with light S and coverage a, and the fire over it, with
light E and coverage F, it shows E + (1 − F) (S + (1 − a) B). Both are the same over any background
if E = P − (1 − F) S and (1 − F) (1 − a) = 1 − A. Of all such splits this takes the one in which the
fire covers no more than its light needs: E ≤ F, as a page cannot be brighter than its coverage.
"""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.picture import Picture, as_light, brightest, darkest, where_covered
from fire_atlas.core.pixels import Pixels, Plane, as_plane, light_added, pixels_of_added
from fire_atlas.effect.composition.cover import cover_of_light

_DULL, _BRIGHT = 0.6, 1.0
"""Brightest channel, as the client shows it, up to which all that is grey in a colour is smoke, and
from which nothing is: white is heat."""

Cover = Literal["full", "thin", "none"]

_AROUND = 0.015
"""Distance up to which light around a pixel tells its hue, heights."""

_BLACK = np.float32(0.2 / 255)
"""Mean of the brightest channel around, as the client shows it, up to which there is no hue."""

_PALE, _VIVID = 0.25, 0.75
"""Saturation up to which what hides is smoke, and from which it is flame, if it glows."""

_UNLIT, _GLOWING = 0.2, 0.6
"""Brightest channel of a colour, as the client shows it, up to which it is that of smoke in the
light of a flame, and from which it is a flame's own."""

_MIN_COVERAGE = np.float32(1e-6)
"""Minimum coverage that light is divided by."""


@dataclass(frozen=True, slots=True)
class Smoke:
    """The smoke of a frame.

    Attributes:
        grey: (H, W) light as the client shows it over black, at most ``coverage``.
        coverage: (H, W) 0..1, the share of the light behind it that it keeps back: 1 − exp(−τ) of
            smoke of the optical depth τ.
    """

    grey: Plane
    coverage: Plane

    @classmethod
    def black(cls, coverage: Plane) -> "Smoke":
        """Return smoke that only keeps light back."""
        return cls(np.zeros_like(coverage), coverage)

    @classmethod
    def of(cls, pixels: Pixels, blend_space: str) -> "Smoke":
        """Return the smoke in a picture (H, W, 4) whose coverage is its own.

        What of a colour is grey and dull is smoke, and so is coverage that no light needs, but of
        colours that are vivid and glow: thin fire whose red hides more than it shines is a flame.
        """
        coverage = np.clip(pixels[..., 3], 0, 1)
        shown = light_added(pixels, blend_space)
        room = np.maximum(coverage, _MIN_COVERAGE)
        most, greyest = brightest(shown) / room, darkest(shown) / room
        # What is nearly black has the hue of what is around it.
        side = 2 * max(1, round(_AROUND * len(pixels))) + 1
        around, covered = (
            cv2.blur(plane, (side, side), borderType=cv2.BORDER_CONSTANT)
            for plane in (shown, coverage)
        )
        light = brightest(around)
        saturation = (light - darkest(around)) / np.maximum(light, _BLACK)
        glow = light / np.maximum(covered, _MIN_COVERAGE)
        vivid = smooth_step((saturation - _PALE) / (_VIVID - _PALE))
        dull = 1 - vivid * smooth_step((glow - _UNLIT) / (_GLOWING - _UNLIT))
        grey = greyest * (1 - smooth_step((most - _DULL) / (_BRIGHT - _DULL)))
        fire = coverage * (most - grey) / (1 - grey)
        smoke = (coverage - fire) / np.maximum(1 - fire, _MIN_COVERAGE)
        # What hides all behind it does so also where it is as bright as a page can be.
        smoke = np.where(coverage >= 1, 1, np.clip(smoke, 0, 1) * dull) * (coverage > 0)
        return cls(as_plane(smoke * grey), as_plane(smoke))

    def pixels(self, blend_space: str) -> Pixels:
        """Return the layer as pixels (H, W, 4)."""
        shown = np.repeat(self.grey[..., None], 3, axis=2)
        return pixels_of_added(shown, self.coverage, blend_space)

    def taken_from(self, pixels: Pixels, cover: Cover, blend_space: str) -> Pixels:
        """Return ``pixels`` (H, W, 4) without this smoke, to be shown over it.

        Args:
            pixels: The picture.
            cover: How much of the smoke a fire of the coverage F hides: ``full``, F; ``thin``,
                what ``cover_of_light`` returns; ``none``, nothing.
            blend_space: Encoding in which the client blends.
        """
        shown, whole = light_added(pixels, blend_space), np.clip(pixels[..., 3], 0, 1)
        room = np.maximum(1 - self.coverage, _MIN_COVERAGE)
        coverage = np.where(self.coverage < whole, 1 - np.minimum((1 - whole) / room, 1), 0)
        if cover != "none":
            # Where both hide all that is behind, the fire covers what its light needs.
            needed = self._needed(brightest(shown), cover)
            coverage = np.where(self.coverage >= 1, needed, coverage)
        hides = {
            "full": coverage,
            "thin": cover_of_light(as_plane(coverage), shown, blend_space, self.coverage),
            "none": np.zeros_like(coverage),
        }[cover]
        light = np.maximum(shown - ((1 - hides) * self.grey)[..., None], 0)
        return pixels_of_added(
            light, np.maximum(coverage, np.minimum(brightest(light), 1)), blend_space
        )

    def _needed(self, most: Plane, cover: Cover) -> Plane:
        """Return the coverage F (H, W) of a fire that shows ``most`` in a channel over smoke
        that hides all: F is that less (1 − G) of the grey, where the fire hides G, F or F²."""
        above = np.maximum(most - self.grey, 0)
        needed = above / np.maximum(1 - self.grey, _MIN_COVERAGE)
        if cover == "thin":  # G is F², as smoke that hides all leaves no more to hide
            needed = 2 * above / (1 + np.sqrt(np.maximum(1 - 4 * self.grey * above, 0)))
        return as_plane(np.minimum(needed, 1))


def hidden_by_smoke(flame: Picture, blend_space: str) -> Plane:
    """Return what smoke hides, (H, W) 0..1, in a picture (H, W, 4) whose coverage is its own."""
    hidden, covered = np.zeros(flame.shape[:2], np.float32), where_covered(flame)
    if flame[covered].size:
        pixels = as_light(np.ascontiguousarray(flame[covered]))
        hidden[covered] = Smoke.of(pixels, blend_space).coverage
    return hidden
