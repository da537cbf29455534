"""Recognise drawn art: of a few colours, as pixel art and vector art are, or with outlines."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels, encode_bytes
from fire_atlas.vision.sampling import evenly_spread

_FRAMES = 3
"""Number of frames whose colours are counted, together."""

_SHADES = 4
"""8-bit channels within this many steps count as equal, whatever the file's compression did."""

_FEW = 48
"""Art of at most this many colours is flat."""

_MAIN = 8
"""Art with smooth edges has more colours; then this many, the most frequent ones, are counted."""

_MIN_COVERED = 0.8
"""It is flat if they cover this fraction of what it shows."""

_OPAQUE, _CRISP = 0.97, 0.12
"""Coverage of an opaque pixel, and the maximum share of visible pixels with less in art that ends
at an outline."""

_VISIBLE = 0.02
"""Pixels of fainter coverage are not counted, nor, as sRGB, of fainter light."""


def is_flat_art(clip: Clip) -> bool:
    """Return whether a mix of two frames of ``clip`` would be noticed as new colours."""
    numbers = evenly_spread(0, clip.count - 1, _FRAMES)
    colours = np.concatenate([_colours(clip.read(i)) for i in numbers])
    counts = np.sort(np.unique(colours, return_counts=True)[1])[::-1]
    return len(counts) <= _FEW or bool(counts[:_MAIN].sum() >= _MIN_COVERED * len(colours))


def ends_at_outlines(clip: Clip) -> bool:
    """Return whether a clip with alpha of its own shows art in shades that end at an outline: few
    of its pixels are half transparent, as where light fades out."""
    if clip.matte != "alpha":
        return False
    numbers = evenly_spread(0, clip.count - 1, _FRAMES)
    coverage = np.concatenate([clip.read(i)[..., 3].ravel() for i in numbers])
    visible = coverage[coverage > _VISIBLE]
    return visible.size > 0 and bool((visible < _OPAQUE).mean() <= _CRISP)


def _colours(pixels: Pixels) -> NDArray[np.uint32]:
    """Return a number for the colour and coverage of each pixel that shows anything, (n,)."""
    shown = encode_bytes(pixels[pixels[..., 3] > _VISIBLE][None])[0]
    visible = shown[shown[:, :3].max(axis=1) > 255 * _VISIBLE].astype(np.uint32) // _SHADES
    return np.asarray(visible @ np.array([1, 1 << 8, 1 << 16, 1 << 24], np.uint32), np.uint32)
