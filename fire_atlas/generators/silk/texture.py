"""A sequence of images of fire that a sheet plays, at any speed (eq. 17), round and round."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Plane, as_plane


@dataclass(frozen=True, slots=True)
class Sequence:
    """N images whose last is followed by the first.

    Attributes:
        images: (N, height, width, channels) float32: heat (1 channel) or linear light (3).
        motion: (N, h, w, 2) float32: where what image n shows is in the next one, as far as that
            can be told: px of an image, x right, y down; on a coarser grid.
    """

    images: NDArray[np.float32]
    motion: NDArray[np.float32]

    def __len__(self) -> int:
        """N."""
        return len(self.images)

    def at(self, phase: float) -> NDArray[np.float32]:
        """Image (height, width, channels) at ``phase``, counted in images, whole or not.

        In between, both neighbours are moved towards each other before they are blended, so that
        a tongue moves on instead of fading out here and in there.
        """
        first = int(np.floor(phase))
        share = np.float32(phase - first)
        first %= len(self)
        here = self.images[first]
        if share == 0:
            return as_plane(here).copy()
        there = self.images[(first + 1) % len(self)]
        motion = self.motion_at(first)
        before = _moved(here, motion, share)
        after = _moved(there, motion, share - 1)
        blended = cv2.addWeighted(before, float(1 - share), after, float(share), 0.0)
        image = as_plane(blended).reshape(here.shape)
        # What moved may have come to the edges, which must stay dark.
        image[[0, -1]] = 0
        image[:, [0, -1]] = 0
        return image

    def motion_at(self, n: int) -> NDArray[np.float32]:
        """Motion (height, width, 2) from image ``n`` to the next, px."""
        height, width = self.images.shape[1:3]
        return as_plane(cv2.resize(self.motion[n], (width, height), interpolation=cv2.INTER_LINEAR))


def _moved(
    image: NDArray[np.float32], motion: NDArray[np.float32], share: np.float32
) -> NDArray[np.float32]:
    """``image`` moved by ``share`` of ``motion``."""
    height, width = motion.shape[:2]
    columns = np.arange(width, dtype=np.float32)[None] - motion[..., 0] * share
    rows = np.arange(height, dtype=np.float32)[:, None] - motion[..., 1] * share
    return as_plane(
        cv2.remap(image, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    )


def framed(shape: tuple[int, int]) -> Plane:
    """Weights (height, width) that fade to nothing towards every edge of a sheet."""
    height, width = shape
    u, v = np.linspace(0, 1, width), np.linspace(0, 1, height)
    across = np.clip((0.5 - np.abs(u - 0.5)) / 0.12, 0, 1)
    along = np.clip((1 - v) / 0.05, 0, 1) * np.clip(v / 0.25, 0, 1)
    return as_plane(np.outer(smooth_step(along), smooth_step(across)))
