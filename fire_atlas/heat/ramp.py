"""Ramps: 256 colours by heat, as bytes of premultiplied or added light.

They are encoded like the pixels of colour pages: a client blends ``ramp[heat]`` as it would blend a
pixel of such a page. They are premultiplied because straight colours jump where coverage is small,
and because a filter may then mix neighbours.
"""

from typing import cast

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import light_over_black
from fire_atlas.core.pixels import REC709, Bytes

MAX_STEP = 6
"""Largest difference of a channel between neighbours, of 255: no step is seen in a fade."""


def finished_ramp(curve: NDArray[np.float64], alpha: str, blend_space: str) -> Bytes:
    """Return a ramp (256, 4) near a curve (256, 4), 0..255.

    Its first entry shows nothing, neighbours differ by at most ``MAX_STEP``, and the light that is
    shown over black never falls.
    """
    entries = [np.zeros(4)]
    for colour in np.rint(curve[1:]):
        entries.append(_next(entries[-1], colour, alpha, blend_space))
    return np.array(entries, np.uint8)


def _next(
    last: NDArray[np.float64], colour: NDArray[np.float64], alpha: str, blend_space: str
) -> NDArray[np.float64]:
    """Return the entry after ``last`` that is nearest to ``colour`` and allowed: if it would be
    darker, as rounding makes some, its green is raised, which brightens the most."""
    entry = np.clip(colour, last - MAX_STEP, last + MAX_STEP).clip(0, 255)
    greens = np.arange(entry[1], min(last[1] + MAX_STEP, 255) + 1)
    tried = np.tile(entry, (len(greens) + 1, 1))
    tried[:-1, 1], tried[-1] = greens, np.maximum(entry, last)
    light = luminance_of(np.vstack([last, tried]).astype(np.uint8), alpha, blend_space)
    allowed = light[1:] >= light[0]
    return cast(NDArray[np.float64], tried[int(np.argmax(allowed))])


def luminance_of(ramp: Bytes, alpha: str, blend_space: str) -> NDArray[np.float64]:
    """Return the luminance of the light that entries (n, 4) show over black, linear, (n,)."""
    light = light_over_black(ramp[None], alpha, blend_space)[0]
    return cast(NDArray[np.float64], light.astype(np.float64) @ REC709.astype(np.float64))
