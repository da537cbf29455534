"""What in a clip is fire: bilevel thresholding, and what it is not (Lee et al., III-A)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, brightness
from fire_atlas.vision.activity import activity

_LIT = 6.0
"""Brightness (0..255) up to which a pixel counts as black."""

_SAMPLES = 12
"""Frames looked at."""

_FOOT = 0.12
"""Part of a sprite's height, around what moves, that is of the fire though it stands still."""

_GLOW = 0.15
"""Distance within which glow fades out, against the root of the flame's area."""

_SHARE = {"alpha": 0.5, "luminance": 0.5, "none": 0.75}
"""Automatic threshold: this share of Otsu's, by matte. Otsu parts the core from the rest of the
flame; in a scene there is more than flame to part it from."""


@dataclass(frozen=True, slots=True)
class Fire:
    """What tells fire from all else, the same in every frame.

    Attributes:
        threshold: Brightness (0..255) above which a pixel is flame.
        place: (H, W) float32, 0..1: where fire ever is, and no prop that it only lights.
        free: (H, W) float32, 0..1: where there is no prop; all that is of the fire, where nothing
            was filmed but the fire.
        is_filmed: Whether there is a scene or a glow around the flame that is none of it.
        blend_space: Of the clip.
    """

    threshold: float
    place: Plane
    free: Plane
    is_filmed: bool
    blend_space: str

    @classmethod
    def of(cls, clip: Clip, threshold: float | None = None) -> "Fire":
        """Look at a few frames; ``threshold`` is chosen from the clip unless given."""
        shown = [clip.brightness(i) for i in _spread(clip.count)]
        is_filmed = clip.matte != "alpha"
        place, free = _place(shown, is_filmed)
        if threshold is None:
            lit = [plane[(plane > _LIT) & (place > 0.5)][::3] for plane in shown]
            values = np.concatenate(lit).astype(np.uint8)
            otsu = cv2.threshold(values, 0, 255, cv2.THRESH_OTSU)[0] if values.size else 0.0
            threshold = max(_SHARE[clip.matte] * otsu, 2.0 * _LIT)
        return cls(threshold, place, free, is_filmed, clip.blend_space)

    def lit(self, pixels: Pixels) -> Bytes:
        """(H, W) 0 or 1: the binarized frame (Figure 4b)."""
        shown = brightness(pixels, self.blend_space)
        return ((shown > self.threshold) & (self.place > 0.3)).astype(np.uint8)

    def content(self, pixels: Pixels, lit: Bytes) -> Pixels:
        """Return the fire alone.

        Around a filmed flame its glow on air and walls is let fade out close to the outline; what
        an artist made transparent already is kept as it is.
        """
        weight = self.place
        if self.is_filmed and lit.any():
            shown = brightness(pixels, self.blend_space)
            reach = max(2.0, _GLOW * float(np.sqrt(np.count_nonzero(lit))))
            away = cv2.distanceTransform(1 - lit, cv2.DIST_L2, 5) / np.float32(reach)
            # As it dims, and not where fire never is: there an outline would show.
            bright = smooth_step(as_plane(2 * shown / np.float32(self.threshold) - 1))
            weight = self.free * as_plane(np.exp(-away * away)) * as_plane(bright)
        return np.asarray(pixels * weight[..., None], np.float32)


def _place(shown: Sequence[Plane], is_filmed: bool) -> tuple[Plane, Plane]:
    """Where fire ever is, and where there is no prop.

    A sprite shows little else: what moves but a little is fire too. In a film what hardly moves is
    a prop, above all if it is always lit, and dimmer than the flame.
    """
    moves = activity(list(shown))
    if not is_filmed:
        side = 2 * max(1, round(_FOOT * moves.shape[0])) + 1
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
        near = as_plane(cv2.dilate(moves, disc))
        place = _filled(as_plane(np.clip((near - 0.12) / 0.15, 0, 1)))
        return place, place
    place = np.clip((moves - 0.5) / 0.3, 0, 1)
    least, most = np.minimum.reduce(list(shown)), np.maximum.reduce(list(shown))
    hot = max(float(np.quantile(most, 0.995)), 1.0)
    steady = (most - least < 0.35 * most) & (least > 0.42 * hot) & (most < 0.96 * hot)
    side = 2 * max(1, round(0.004 * sum(steady.shape))) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    # Thin steady lines are the outline of a calm flame.
    prop = cv2.morphologyEx(steady.astype(np.uint8), cv2.MORPH_OPEN, disc)
    # What the fire surrounds is fire: a prop reaches to where nothing moves.
    _, labels = cv2.connectedComponents(prop, connectivity=8)
    still = np.unique(labels[(moves < 0.2) & (prop > 0)])
    near = cv2.dilate(np.isin(labels, still).astype(np.uint8), disc).astype(np.float32)
    free = as_plane(1 - cv2.blur(near, (3, 3)))
    place = _filled(as_plane(place * free))
    return place, np.maximum(place, free)


def _filled(place: Plane) -> Plane:
    """Fill what is surrounded: the wick, and what never changes around it, are of the flame."""
    framed = np.pad((place > 0.5).astype(np.uint8), 1)
    outside = framed.copy()
    cv2.floodFill(outside, None, (0, 0), 2)
    inside = (outside != 2)[1:-1, 1:-1]
    return as_plane(np.where(inside, np.maximum(place, 1), place))


def connected(lit: Bytes) -> NDArray[np.bool_]:
    """(H, W): the connected flame of a binarized frame: the largest, nicks of a pixel closed."""
    closed = cv2.morphologyEx(lit, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    if count < 2:
        return np.zeros(lit.shape, np.bool_)
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return np.asarray((labels == largest) & (lit > 0), np.bool_)


def _spread(count: int) -> list[int]:
    """A dozen frame numbers, evenly spread."""
    return sorted({round(float(i)) for i in np.linspace(0, count - 1, _SAMPLES)})
