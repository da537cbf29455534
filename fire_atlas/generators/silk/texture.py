"""Animated textures that loop: images of fire, and the motion from each to the next."""

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
    """N images whose last is followed by the first; they can be played at any rate (eq. 17).

    Attributes:
        images: (N, height, width, channels) float32: heat (1 channel) or linear light (3).
        motion: (N, h, w, 2) float32: displacement of what image n shows to the next one: px of an
            image, x right, y down; on a coarser grid.
    """

    images: NDArray[np.float32]
    motion: NDArray[np.float32]

    def __len__(self) -> int:
        """N."""
        return len(self.images)

    def image_at(self, phase: float) -> Image:
        """Image at ``phase``, counted in images.

        Between two images both are warped towards each other before they are blended: a tongue
        moves on instead of fading out in one place and in at another.
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
        # What was warped to the edges must not show there.
        blend[[0, -1]] = 0
        blend[:, [0, -1]] = 0
        return blend

    def motion_from(self, n: int) -> NDArray[np.float32]:
        """Displacement (height, width, 2) from image ``n`` to the next, px."""
        height, width = self.images.shape[1:3]
        return as_plane(cv2.resize(self.motion[n], (width, height), interpolation=cv2.INTER_LINEAR))


def edge_fade(shape: tuple[int, int]) -> Plane:
    """Weights (height, width) that fall to 0 towards every edge of a sheet."""
    height, width = shape
    u, v = np.linspace(0, 1, width), np.linspace(0, 1, height)
    across = np.clip((0.5 - np.abs(u - 0.5)) / 0.12, 0, 1)
    along = np.clip((1 - v) / 0.05, 0, 1) * np.clip(v / 0.25, 0, 1)
    return as_plane(np.outer(smooth_step(along), smooth_step(across)))
