"""The region of a frame that is its flame."""

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes


def largest_flame(binarized: Bytes) -> NDArray[np.bool_]:
    """Return (H, W): the largest connected flame of a binarized frame, bridging 1 px gaps."""
    closed = cv2.morphologyEx(binarized, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=8)
    if count < 2:
        return np.zeros(binarized.shape, np.bool_)
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return np.asarray((labels == largest) & (binarized > 0), np.bool_)
