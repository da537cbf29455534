"""Smaller variants of a frame, filtered in linear light."""

from typing import cast

import cv2
import numpy as np

from fire_atlas.atlas.trim import up_to
from fire_atlas.core.pixels import Pixels


def shrink(pixels: Pixels, factor: int) -> Pixels:
    """Return pixels (H, W, 4) in 1 / ``factor`` of the size, rounded up.

    Each pixel is the mean of a block of the premultiplied light; beyond the frame there is none.
    """
    height, width = pixels.shape[:2]
    whole = np.zeros((up_to(factor, height), up_to(factor, width), 4), np.float32)
    whole[:height, :width] = pixels
    size = whole.shape[1] // factor, whole.shape[0] // factor
    return cast(Pixels, cv2.resize(whole, size, interpolation=cv2.INTER_AREA))
