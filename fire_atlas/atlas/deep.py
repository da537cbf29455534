"""Encoded pixels in 16 bits a channel, whose 8-bit values are those of an 8-bit page."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes

_STEP = 257
"""Steps of 16 bits in one of 8 bits: 255 · 257 is 65535."""


def deepened(image: Bytes, exact: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Return ``exact`` (H, W, C), 0..1, in 16 bits, rounded to 8 bits no other than ``image``.

    Eight-bit pages are encoded by tables, whose steps may round otherwise; and what is invisible in
    them stays 0, so that pages of both depths have the same layout.
    """
    middle = image.astype(np.float64) * _STEP
    words = np.clip(np.rint(exact * 65535), middle - _STEP // 2, middle + _STEP // 2)
    words[~image.any(axis=2)] = 0
    return np.asarray(np.clip(words, 0, 65535), np.uint16)


def as_bytes(image: NDArray[np.uint8] | NDArray[np.uint16]) -> Bytes:
    """Return an image (H, W, C) of 8 or 16 bits a channel in 8 bits, rounded."""
    if image.dtype == np.uint8:
        return image.astype(np.uint8, copy=False)
    return np.asarray((image.astype(np.uint32) + _STEP // 2) // _STEP, np.uint8)
