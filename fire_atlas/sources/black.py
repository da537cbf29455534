"""Find the black level of footage of fire on black, and take it off.

Cameras, editors and wrongly flagged video ranges raise black: then the background would become a
veil over whatever is behind the atlas. Black is what is darkest and flat. Dim flame and glow are
not: their brightness has no value at which pixels crowd.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import Picture, brightest, srgb_unit
from fire_atlas.core.pixels import Plane, as_plane

_NOISE = 2.0
"""Noise of black, of 255, that is always assumed: the rounding of codecs."""
_MAX_NOISE = 8.0
"""Limit on the noise, of 255: what is brighter may be flame."""
_DARKEST = 64
"""Levels of black are below this, of 255."""
_SPREAD = 6.0
"""Pixels whose brightest channel is this close to the level, of 255, are its population."""
_DARKER = 0.01
"""Share of a frame that may be darker than its black: noise, and overshoots of codecs."""
_CROWD = 0.05
"""Least share of a frame that its black has."""
_UNEVENNESS = 1.5
"""Limit on the spread of its population over the noise between neighbouring pixels, which is all
that spreads black. A glow changes slowly from pixel to pixel, and spreads over many levels."""
_SIDE = 256
"""Frames are measured in about as many rows: every k-th pixel of larger ones, noise included."""


@dataclass(frozen=True, slots=True)
class BlackLevel:
    """The black of footage.

    Attributes:
        level: Of R, G and B: sRGB in 0..1, below 1.
        noise: Greatest deviation of black pixels from it, sRGB in 0..1.
    """

    level: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: float = _NOISE / 255

    @classmethod
    def grey(cls, level: float) -> Self:
        """Return a black that is the same grey in all channels, ``level`` of 255."""
        unit = level / 255
        return cls((unit, unit, unit))

    @property
    def noise_above(self) -> float:
        """Value, 0..1, up to which pixels are black after the level is taken off."""
        return self.noise / (1 - max(self.level)) + 1e-6

    def taken_off(self, planes: Sequence[Plane]) -> list[Plane]:
        """Return R, G and B, sRGB in 0..1, without the level, and stretched so that 1 stays 1."""
        if max(self.level) == 0:
            return list(planes)
        return [
            as_plane(np.maximum(plane - np.float32(level), 0) * np.float32(1 / (1 - level)))
            for plane, level in zip(planes, self.level, strict=True)
        ]


TRUE_BLACK = BlackLevel()
"""Black of footage whose black is 0."""


def find_black(frames: Iterable[Picture]) -> BlackLevel:
    """Return the black of opaque sample frames, which may differ in size.

    It is the median of those of the frames that have one. It is true black if fewer than half do,
    or if true black explains it, with the noise that is always assumed.
    """
    measured = [_black_of(255 * srgb_unit(frame)) for frame in frames]
    found = np.array([black for black in measured if black is not None])
    if 2 * len(found) <= len(measured):
        return TRUE_BLACK
    red, green, blue, noise = (float(level) for level in np.median(found, axis=0))
    if max(red, green, blue) <= _NOISE:
        return TRUE_BLACK
    return BlackLevel((red / 255, green / 255, blue / 255), noise / 255)


def _black_of(frame: NDArray[np.float32]) -> tuple[float, float, float, float] | None:
    """Return the level of R, G and B in a frame (H, W, 3), and its noise, all of 255."""
    step = max(1, len(frame) // _SIDE)
    pixels = frame[::step, ::step]
    peak = brightest(pixels)
    crowd = _darkest_crowd(peak.ravel())
    if crowd is None:
        return None
    near = np.abs(peak - crowd) <= _SPREAD
    if near.mean() < _CROWD or not _is_flat(peak, near):
        return None
    black = pixels[near]
    red, green, blue = level = np.median(black, axis=0)
    # Glow only brightens black, so that the noise is seen below the level alone.
    below = float((level - np.percentile(black, 0.1, axis=0)).max())
    return float(red), float(green), float(blue), min(max(_NOISE, below), _MAX_NOISE)


def _is_flat(peak: Plane, near: NDArray[np.bool_]) -> bool:
    """Return whether nothing but noise spreads the pixels that are ``near`` a level, (H, W)."""
    spread = 1.4826 * float(np.median(np.abs(peak[near] - np.median(peak[near]))))
    steps = np.diff(peak, axis=1)[near[:, 1:] & near[:, :-1]]
    noise = float(steps.std()) / 2**0.5 if steps.size else 0.0
    return spread <= max(1.5, _UNEVENNESS * noise)


def _darkest_crowd(peak: NDArray[np.float32]) -> int | None:
    """Return the value, of 255, at which the darkest pixels crowd; None if they are bright.

    ``peak``: (pixels,), the brightest channel of each, 0..255.
    """
    counts = np.bincount(np.rint(peak).astype(np.intp), minlength=256)
    darker, smooth = np.cumsum(counts), np.convolve(counts, [1, 1, 1], "same")
    crowd, top = None, _DARKEST
    while top > 0 and (darker[top - 1] > _DARKER * len(peak)):
        crowd = int(np.argmax(smooth[:top]))
        top = crowd - round(_SPREAD)
    return crowd
