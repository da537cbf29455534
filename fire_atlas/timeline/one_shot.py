"""Clips that play once: their light flares up from nothing, or fades to nothing."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import luminance
from fire_atlas.vision.sampling import Samples

_NOTHING = 0.15
"""A frame with less than this share of the brightest frame's light shows next to nothing."""


_SCENE = 2 / 3
"""Where a lit scene is behind the fire, such a frame has less than this share of all light too."""


def why_once(samples: Samples) -> str | None:
    """Say, as a sentence, why a clip is not meant to go round; None if nothing speaks against it.

    What decides is light, summed over the frame: it is next to nothing at one end or at both, and
    nowhere in between, where a fire that only flickers would be dark too.
    """
    whole, fire = _light(samples)
    dark = (fire < _NOTHING * fire.max()) & (whole < _SCENE * whole.max())
    bright = np.flatnonzero(~dark)
    if not dark.any() or dark[bright[0] : bright[-1]].any():
        return None
    ends = {"flares up from nothing": dark[0], "fades to nothing": dark[-1]}
    told = " and ".join(what for what, is_so in ends.items() if is_so)
    least = 100 * float(fire[dark].min() / fire.max())
    return f"the fire {told} ({least:.0f} % of its brightest light)"


def _light(samples: Samples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Light of each sampled frame, in order: all of it, and without what is always there.

    Only in an opaque scene is something there beside the fire.
    """
    frames = samples.frames.values()
    planes = np.stack([luminance(frame) for frame in frames])
    is_scene = all(frame[..., 3].min() >= 1 for frame in frames)
    behind = planes.min(axis=0) if is_scene else np.zeros_like(planes[0])
    return planes.sum(axis=(1, 2), dtype=np.float64), (planes - behind).sum(
        axis=(1, 2), dtype=np.float64
    )
