"""Dither: soft light that is to be stored in 8 bits changes by less than a step from px to px, and
would show rings. Half a step more or less, by a fixed pattern, lets neighbours average to it."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane, as_plane, decode_unit, encode_unit

_STEP = np.float32(1 / 255)


def dithered(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return linear light (H, W, channels), 0..1, of which sRGB in 8 bits shows no rings.

    Each value is changed by up to half a step, all channels of a pixel alike, so that no hue
    changes; what is less than half a step is none and stays none.
    """
    shown = encode_unit(light)
    height, width = light.shape[:2]
    changed = shown + _pattern(height, width)[..., None] * _STEP
    return np.where(shown > _STEP / 2, decode_unit(as_plane(changed)), light)


@lru_cache(maxsize=4)
def _pattern(height: int, width: int) -> Plane:
    """Return values (height, width) spread evenly over −½..½, of which neighbours are unlike:
    interleaved gradient noise (Jimenez, Next Generation Post Processing in Call of Duty, 2014)."""
    x, y = np.arange(width), np.arange(height)[:, None]
    return as_plane((52.9829189 * ((0.06711056 * x + 0.00583715 * y) % 1)) % 1 - 0.5)
