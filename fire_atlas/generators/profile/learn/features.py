"""Find the flame's pixels in a frame, their outline and its six feature points (Lee et al., III-A).

The paper thresholds frames filmed in front of black. Here fire is also distinguished from props
(such as candles), lit walls and glow, by comparing several frames: only fire flickers.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, brightness
from fire_atlas.generators.profile.model import FeaturePoints
from fire_atlas.vision.activity import activity
from fire_atlas.vision.sampling import evenly_spread

_BLACK = 6.0
"""Brightness (0..255) up to which a pixel counts as black."""

_SAMPLES = 12
"""Number of frames from which masks and threshold are chosen."""

_STILL_MARGIN = 0.12
"""Still pixels of a sprite this near to moving ones, in frame heights, count as fire too."""

_GLOW = 0.15
"""Distance over which glow fades out, relative to the square root of the flame's area."""

_OTSU_SHARE = {"alpha": 0.5, "luminance": 0.5, "none": 0.75}
"""Automatic threshold as a fraction of Otsu's, by matte. Otsu's separates the core from the rest of
the flame; without a matte there is also a scene, which needs a higher one."""

_PERSISTENT = 0.2
"""Fraction of the flame's height in the persistent regime, the lowest of McCaffrey's three."""

_FOOT = 0.06
"""Fraction of the flame's height, from its lowest pixel up, that counts as its foot."""


@dataclass(frozen=True, slots=True)
class FireMask:
    """Threshold and masks that separate fire from everything else in all frames of a clip.

    Attributes:
        threshold: Brightness (0..255) above which a pixel is flame.
        fire: (H, W) float32, 0..1: where there is fire in any frame; not props it only lights.
        no_prop: (H, W) float32, 0..1: where there is no prop; in sprites, the same as ``fire``.
        is_filmed: Whether frames may show a scene or glow around the flame (no alpha matte).
        blend_space: Blend space of the clip.
    """

    threshold: float
    fire: Plane
    no_prop: Plane
    is_filmed: bool
    blend_space: str

    @classmethod
    def of(cls, clip: Clip, threshold: float | None = None) -> "FireMask":
        """Find the fire in a clip; ``threshold`` is chosen from the clip if it is None."""
        # A dozen frames, evenly spread.
        numbers = evenly_spread(0, clip.count - 1, _SAMPLES)
        samples = [clip.brightness(i) for i in numbers]
        is_filmed = clip.matte != "alpha"
        fire, no_prop = _masks(samples, is_filmed)
        if threshold is None:
            of_fire = [plane[(plane > _BLACK) & (fire > 0.5)][::3] for plane in samples]
            values = np.concatenate(of_fire).astype(np.uint8)
            otsu = cv2.threshold(values, 0, 255, cv2.THRESH_OTSU)[0] if values.size else 0.0
            threshold = max(_OTSU_SHARE[clip.matte] * otsu, 2.0 * _BLACK)
        return cls(threshold, fire, no_prop, is_filmed, clip.blend_space)

    def binarized(self, pixels: Pixels) -> Bytes:
        """Return (H, W): 1 where a frame is flame, else 0 (Figure 4b)."""
        return self.binarized_brightness(brightness(pixels, self.blend_space))

    def binarized_brightness(self, bright: Plane) -> Bytes:
        """Return ``binarized`` of a frame of a brightness (H, W), 0..255."""
        return ((bright > self.threshold) & (self.fire > 0.3)).astype(np.uint8)

    def isolated(self, pixels: Pixels, bright: Plane | None = None) -> Pixels:
        """Return the fire alone; ``bright`` is the brightness (H, W) of the frame, if it is known.

        The glow of a filmed flame on air and walls fades out close to its outline; sprites with
        alpha keep their glow.
        """
        weight = self.fire
        if self.is_filmed:
            bright = brightness(pixels, self.blend_space) if bright is None else bright
            binarized = self.binarized_brightness(bright)
            if binarized.any():
                weight = self._near(binarized) * self._fade(bright)
        return as_plane(cv2.multiply(pixels, cv2.merge([weight] * 4)))

    def _near(self, binarized: Bytes) -> Plane:
        """Return how much of what is around a filmed flame (H, W) belongs to it."""
        glow = max(2.0, _GLOW * float(np.sqrt(np.count_nonzero(binarized))))
        distance = cv2.distanceTransform(1 - binarized, cv2.DIST_L2, 5) / np.float32(glow)
        return self.no_prop * as_plane(np.exp(-distance * distance))

    def isolated_flame(
        self, pixels: Pixels, bright: Plane, flame: NDArray[np.bool_]
    ) -> NDArray[np.float32]:
        """Return the pixels (n, 4) of a flame, given as a mask (H, W) of binarized pixels, as
        ``isolated`` shows them; ``bright`` is the brightness (H, W) of the frame."""
        weight = self.fire[flame]
        if self.is_filmed:
            weight = self.no_prop[flame] * self._fade(bright[flame])
        return np.asarray(pixels[flame] * weight[:, None], np.float32)

    def _fade(self, bright: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return how much of a glow of such brightness is kept: it fades as it gets dim. Masking it
        by ``fire`` would show that mask's outline."""
        return smooth_step(as_plane(2 * bright / np.float32(self.threshold) - 1))


def _masks(samples: Sequence[Plane], is_filmed: bool) -> tuple[Plane, Plane]:
    """Return the masks ``fire`` and ``no_prop`` of ``FireMask``.

    In a sprite even pixels that move a little are fire. In a filmed clip pixels that hardly move
    are not, and those that are always lit, but dimmer than the flame, are a prop.
    """
    moves = activity(list(samples))
    if not is_filmed:
        side = 2 * max(1, round(_STILL_MARGIN * moves.shape[0])) + 1
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
        near = as_plane(cv2.dilate(moves, disc))
        fire = _with_holes_filled(as_plane(np.clip((near - 0.12) / 0.15, 0, 1)))
        return fire, fire
    fire = np.clip((moves - 0.5) / 0.3, 0, 1)
    least, most = np.minimum.reduce(list(samples)), np.maximum.reduce(list(samples))
    hot = max(float(np.quantile(most, 0.995)), 1.0)
    steady = (most - least < 0.35 * most) & (least > 0.42 * hot) & (most < 0.96 * hot)
    side = 2 * max(1, round(0.004 * sum(steady.shape))) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    # Opening removes thin lines: they are the outline of a calm flame, not a prop.
    prop = cv2.morphologyEx(steady.astype(np.uint8), cv2.MORPH_OPEN, disc)
    # A prop must include still pixels; steady pixels among moving ones are fire.
    _, labels = cv2.connectedComponents(prop, connectivity=8)
    still = np.unique(labels[(moves < 0.2) & (prop > 0)])
    near = cv2.dilate(np.isin(labels, still).astype(np.uint8), disc).astype(np.float32)
    no_prop = as_plane(1 - cv2.blur(near, (3, 3)))
    fire = _with_holes_filled(as_plane(fire * no_prop))
    return fire, np.maximum(fire, no_prop)


def _with_holes_filled(mask: Plane) -> Plane:
    """Fill the holes of a mask: the wick and the steady core around it belong to the flame."""
    framed = np.pad((mask > 0.5).astype(np.uint8), 1)
    outside = framed.copy()
    cv2.floodFill(outside, None, (0, 0), 2)
    inside = (outside != 2)[1:-1, 1:-1]
    return as_plane(np.where(inside, np.maximum(mask, 1), mask))


def contour(flame: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (H, W): the flame's outline, its pixels where Sobel's gradient of the mask is not 0.
    Flame pixels at the edge of the frame belong to it."""
    left, top, width, height = cv2.boundingRect(flame.view(np.uint8))
    box = slice(top, top + height), slice(left, left + width)
    framed = np.pad(flame[box].astype(np.uint8), 1)
    gx = cv2.Sobel(framed, cv2.CV_16S, 1, 0)
    gy = cv2.Sobel(framed, cv2.CV_16S, 0, 1)
    edge = np.zeros_like(flame)
    np.logical_and(((gx != 0) | (gy != 0))[1:-1, 1:-1], flame[box], out=edge[box])
    return edge


def feature_points(flame: NDArray[np.bool_]) -> FeaturePoints:
    """Find the six feature points of a flame, given as a mask (H, W) that is not empty.

    Pixels have an extent: a flame of columns 3 and 4 reaches from x = 3.0 to 5.0.
    """
    edge = contour(flame)
    rows = np.flatnonzero(edge.any(axis=1))
    top, bottom = int(rows[0]), int(rows[-1])
    lowest = math.floor(bottom + 1 - _PERSISTENT * (bottom + 1 - top))
    left, right, row = _widest(edge, range(max(lowest, top), bottom + 1))
    # All ends of a foot count, because the lowest of them changes from frame to frame.
    ends = max(1, math.ceil(_FOOT * (bottom + 1 - top)))
    foot = _middle(edge[bottom + 1 - ends : bottom + 1]), bottom + 1.0
    return FeaturePoints(
        left=(left, row),
        mid_left=_lower_outline(edge, (left + foot[0]) / 2),
        bottom=foot,
        mid_right=_lower_outline(edge, (foot[0] + right) / 2),
        right=(right, row),
        top=(_middle(edge[top : top + 1]), float(top)),
    )


def flame_lean(flame: NDArray[np.bool_]) -> float:
    """Return the lean of a flame, given as a mask (H, W) that is not empty, degrees to the right.

    It is that of the straight line from which the flame's pixels are, in their rows, at the least
    squared distance. Lee et al., III-B, have the line from Bottom to Top; in a fire of several
    tongues Top hops from one to another while the fire stands still.
    """
    rows, columns = np.nonzero(flame)
    height = rows.mean() - rows
    return math.degrees(math.atan2(float(height @ columns), float(height @ height)))


def _widest(edge: NDArray[np.bool_], rows: range) -> tuple[float, float, float]:
    """Return left end, right end and y of the widest of ``rows``; of equal ones the lowest."""
    ends = [(np.flatnonzero(edge[row]), row) for row in rows]
    columns, row = max(
        ((found, row) for found, row in reversed(ends) if found.size),
        key=lambda end: end[0][-1] - end[0][0],
    )
    return float(columns[0]), float(columns[-1] + 1), row + 0.5


def _middle(rows: NDArray[np.bool_]) -> float:
    columns = np.flatnonzero(rows.any(axis=0))
    return float(columns[0] + columns[-1] + 1) / 2


def _lower_outline(edge: NDArray[np.bool_], x: float) -> tuple[float, float]:
    """Return the point of the lower outline at ``x``; its y is that of the nearest column."""
    columns = np.flatnonzero(edge.any(axis=0))
    column = int(columns[np.argmin(np.abs(columns + 0.5 - x))])
    return x, float(np.flatnonzero(edge[:, column])[-1] + 1)
