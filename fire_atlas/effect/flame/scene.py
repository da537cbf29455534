"""Opaque scenes: what in them stands still and is only lit, and what is flame."""

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from fire_atlas.core.clip import Window
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.vision.activity import flicker, mean_of


@dataclass(frozen=True, slots=True)
class Scene:
    """What stands still in an opaque scene, lit by the fire.

    Attributes:
        mean: (H, W) mean brightness, 0..255.
        still: (H, W) least brightness, had the light not flickered.
        hot: Brightness that only flame has.
    """

    mean: Plane
    still: Plane
    hot: float

    @classmethod
    def behind(cls, planes: list[Plane]) -> "Scene":
        """Return what stands still in a few frames, given as brightness."""
        mean = mean_of(planes)
        unlit = (plane / max(flicker(plane, mean), np.float32(0.1)) for plane in planes)
        least: Plane = reduce(np.minimum, unlit)
        peak: Plane = reduce(np.maximum, planes)
        return cls(mean, least, max(float(np.quantile(peak, 0.995)), 1.0))

    def within(self, window: Window) -> "Scene":
        """Return what stands still in a part of the frame."""
        return replace(self, mean=self.mean[window.slices], still=self.still[window.slices])

    def flame(self, bright: Plane, pixels: Pixels) -> Plane:
        """How surely each pixel of a frame is flame by its colour and light, (H, W) in 0..1.

        Flame is warm, and brighter than the scene is there at the moment; where it never goes out,
        the scene cannot be seen, but nothing else is as bright.
        """
        now = self.still * flicker(bright, self.mean)
        stands_out = above(as_plane(bright - now), 12.0, 40.0)
        core = above(self.still, 0.8 * self.hot, self.hot)
        return warmth(pixels) * np.maximum(stands_out, core)


def above(plane: Plane, dim: float, bright: float) -> Plane:
    """How bright each pixel is, (H, W) in 0..1: 0 up to ``dim``, 1 from ``bright`` on."""
    return as_plane(np.clip((plane - dim) / (bright - dim), 0.0, 1.0))


def warmth(pixels: Pixels) -> Plane:
    """How fire-like the colour of each pixel is, (H, W) in 0..1: red above blue, or white-hot."""
    red, blue = pixels[..., 0], pixels[..., 2]
    fire_like = np.maximum((red - blue) / (red + 1e-4) * 2.0 - 0.3, red - 0.7)
    return as_plane(np.clip(fire_like, 0.0, 1.0))
