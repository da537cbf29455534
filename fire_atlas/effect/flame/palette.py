"""The colours a clip is painted with."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import encode_bytes, unpremultiply
from fire_atlas.core.workers import Workers

_SAMPLES = 16
"""Frames looked at, evenly spread over the clip."""

_MOST = 512
"""Colours kept, the most frequent ones: pixel art has fewer, a painting has no palette."""


def clip_palette(clip: Clip, workers: Workers) -> NDArray[np.float32]:
    """Return the opaque colours of ``clip``, (colours, 3) sRGB in 0..1."""
    picks = sorted({round(i) for i in np.linspace(0, clip.count - 1, _SAMPLES)})
    counted = np.zeros(1 << 24, np.int64)
    for codes in workers.map(lambda i: _opaque_codes(clip, i), picks):
        np.add.at(counted, codes, 1)
    used = np.flatnonzero(counted)
    often = used[np.argsort(-counted[used], kind="stable")][:_MOST]
    if often.size == 0:
        often = np.array([0xFFFFFF])
    channels = np.stack([often >> 16, often >> 8 & 255, often & 255], axis=1)
    return (channels / 255).astype(np.float32)


def _opaque_codes(clip: Clip, i: int) -> NDArray[np.int64]:
    """Return 0xRRGGBB of every pixel of frame ``i`` that is more than half covered."""
    pixels = clip.read(i)
    solid = pixels[pixels[..., 3] > 0.5][None]
    red, green, blue = encode_bytes(unpremultiply(solid))[0].T.astype(np.int64)
    return np.asarray(red << 16 | green << 8 | blue, np.int64)
