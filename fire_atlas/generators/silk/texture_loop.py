"""Looping animated textures: images of fire, and the motion from each image to the next."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.vision.warp import warp_by_pixels

Image = NDArray[np.float32]
"""(height, width, channels) float32: heat (1 channel) or linear light (3)."""


@dataclass(frozen=True, slots=True)
class TextureLoop:
    """A loop of N images that can be played at any rate (eq. 17).

    Attributes:
        images: (N, height, width, channels) float32: heat (1 channel) or linear light (3).
        motion: (N, h, w, 2) float32: displacement from image n to the next, on a coarser grid but
            in px of the image, x right, y down.
    """

    images: NDArray[np.float32]
    motion: NDArray[np.float32]

    def __len__(self) -> int:
        """Return N."""
        return len(self.images)

    def image_at(self, phase: float) -> Image:
        """Return the image at ``phase``, in images: fractions blend two.

        Both are first warped towards each other along the motion, so that a tongue moves instead
        of fading out in one place and in at another.
        """
        first = int(np.floor(phase))
        share = np.float32(phase - first)
        first %= len(self)
        image = self.images[first]
        if share == 0:
            return as_plane(image).copy()
        following = self.images[(first + 1) % len(self)]
        motion = self.motion_from(first)
        before = warp_by_pixels(image, motion, -float(share), border=cv2.BORDER_CONSTANT)
        after = warp_by_pixels(following, motion, float(1 - share), border=cv2.BORDER_CONSTANT)
        blended = cv2.addWeighted(before, float(1 - share), after, float(share), 0.0)
        blend = as_plane(blended).reshape(image.shape)
        # Keep the edges dark: warping may move light to them.
        blend[[0, -1]] = 0
        blend[:, [0, -1]] = 0
        return blend

    def motion_from(self, n: int) -> NDArray[np.float32]:
        """Return the displacement (height, width, 2) from image ``n`` to the next, px."""
        height, width = self.images.shape[1:3]
        return as_plane(cv2.resize(self.motion[n], (width, height), interpolation=cv2.INTER_LINEAR))


def edge_fade(shape: tuple[int, int]) -> Plane:
    """Return weights (height, width) that fall to 0 towards every edge of a sheet."""
    height, width = shape
    u, v = np.linspace(0, 1, width), np.linspace(0, 1, height)
    across = np.clip((0.5 - np.abs(u - 0.5)) / 0.12, 0, 1)
    along = np.clip((1 - v) / 0.05, 0, 1) * np.clip(v / 0.25, 0, 1)
    return as_plane(np.outer(smooth_step(along), smooth_step(across)))
