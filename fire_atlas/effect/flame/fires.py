"""The fires of a clip: which of several flames each pixel belongs to."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.vision.flow import resized

_SIDE = 128
"""Longest side, px, of the copy on which fires are separated."""

_FLAME = 0.3
"""Confidence that a pixel is flame from which it counts as burning."""

_OFTEN, _SELDOM = 0.6, 0.25
"""A fire burns in some place in at least this part of the frames; two fires are joined by flame in
less than this part of them."""

_MIN_SHARE = 0.03
"""Minimum area of a fire relative to the largest: less is a speck of it."""

_MAX_FIRES = 64
"""Maximum number of fires; the smallest of more belong to their neighbours."""

Labels = NDArray[np.uint8]
"""(H, W), the number of the fire that each pixel belongs to, from 0."""


@dataclass(frozen=True, slots=True)
class Fire:
    """What is measured of one fire of a clip, for all its frames.

    Attributes:
        share: Its part of the flame's area, 0..1; all fires together have 1.
        epsilon: ε (eq. 2): the recipe's, or the automatic one.
        alpha: Automatic α, the threshold of candidates for flakes.
        candidate_count: Mean number of candidates per frame at that α, or at the paper's with its
            preset.
    """

    share: float
    epsilon: float
    alpha: float
    candidate_count: float


@dataclass(frozen=True, slots=True)
class Fires:
    """All fires of a clip, at least one.

    Attributes:
        labels: The fire of each pixel, whether it ever burns or not.
        by_number: The fires, in the order of their numbers in ``labels``.
    """

    labels: Labels
    by_number: tuple[Fire, ...]

    @classmethod
    def single(cls, shape: tuple[int, int], fire: Fire) -> Self:
        """Return one fire that has all pixels of a frame of ``shape`` (H, W)."""
        return cls(np.zeros(shape, np.uint8), (fire,))

    def per_pixel(self, values: Sequence[float]) -> np.float32 | Plane:
        """Return for each pixel the value of its fire, (H, W); one number if there is one fire."""
        table = np.array(values, np.float32)
        return table[0] if len(table) == 1 else as_plane(table[self.labels])

    def epsilon(self) -> np.float32 | Plane:
        """Return ε of each pixel, or of all."""
        return self.per_pixel([fire.epsilon for fire in self.by_number])

    def cropped(self, window: Window) -> Self:
        """Return the fires in a window of the frame."""
        return replace(self, labels=self.labels[window.slices])


def separate_fires(masks: Sequence[Plane]) -> Labels:
    """Separate the fires of a clip by a few frames; all labels are 0 if there is one fire.

    A fire is a region that is connected by flame, with hysteresis over time: it contains a place
    that burns in most of the frames, and reaches as far as any burns in a quarter of them.
    So tongues that come off a flame, which are nowhere for long, are no fires; a flame that tears
    for a few frames remains one, and two that touch for a few remain two. A fire that crosses the
    frame burns nowhere for long and is never divided.

    Every other pixel belongs to the nearest fire.

    Args:
        masks: Confidence (H, W), 0..1, that each pixel is flame, in frames all over the clip.
    """
    height, width = masks[0].shape
    scale = min(1.0, _SIDE / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    presence = np.mean([resized(mask, size) > _FLAME for mask in masks], axis=0)
    count, regions = cv2.connectedComponents((presence >= _SELDOM).astype(np.uint8))
    areas = np.bincount(regions.ravel(), minlength=count)
    areas[0] = 0  # what is no region
    holds_fire = np.bincount(regions.ravel(), presence.ravel() >= _OFTEN, count) > 0
    fires = np.flatnonzero(holds_fire & (areas >= max(_MIN_SHARE * areas.max(), 1)))
    if len(fires) < 2:
        return np.zeros((height, width), np.uint8)
    fires = np.sort(fires[np.argsort(-areas[fires], kind="stable")][:_MAX_FIRES])
    outside = (~np.isin(regions, fires)).astype(np.uint8)
    _, nearest = cv2.distanceTransformWithLabels(outside, cv2.DIST_L2, cv2.DIST_MASK_5)
    number = np.zeros(int(nearest.max()) + 1, np.uint8)
    number[nearest[outside == 0]] = np.searchsorted(fires, regions[outside == 0])
    labels = number[nearest]
    return np.asarray(cv2.resize(labels, (width, height), interpolation=cv2.INTER_NEAREST))
