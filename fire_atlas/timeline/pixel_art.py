"""Pixel art: what is drawn in few colours must not be mixed."""

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import encode_bytes

_COLOURS = 64
"""Most colours, transparency among them, that a frame of pixel art has."""


def is_pixel_art(clip: Clip) -> bool:
    """Whether a clip has so few colours that a mix of two would be seen as a new one."""
    shown = np.ascontiguousarray(encode_bytes(clip.read(0)))
    return len(np.unique(shown.view(np.uint32))) <= _COLOURS
