"""Flames of which everything is known."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Bytes, Pixels, srgb_to_linear
from fire_atlas.generators.profile.model import FeaturePoints

Mask = NDArray[np.bool_]

WIDTH, HEIGHT = 160, 220
FOOT, BASE, TIP = 80.0, 200.0, 60.0
"""Axis, ground and tip of the flame, px."""

_LEVER = 1.123
"""Slope of the axis of a kite, relative to that of the line to its tip: its foot stays."""


def points(lean: float, half: float = 20.0) -> FeaturePoints:
    """Six points of a kite whose axis leans by ``lean`` degrees, its foot 20 px high, its tip
    blunt."""
    top = FOOT + math.tan(math.radians(lean)) * (BASE - TIP) / _LEVER
    left, right = (FOOT - half, BASE - 20), (FOOT + half, BASE - 20)
    mid = half / 2
    return FeaturePoints(
        left, (FOOT - mid, BASE - 10), (FOOT, BASE), (FOOT + mid, BASE - 10), right, (top, TIP)
    )


def kite(lean: float, half: float = 20.0) -> Mask:
    """Which pixels' middles lie in the kite of those points."""
    six = points(lean, half)
    (x, y), blunt = six.top, 3.0
    corners = [six.left, (x - blunt, y), (x + blunt, y), six.right, six.bottom]
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    inside = np.ones((HEIGHT, WIDTH), np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        inside &= (x1 - x0) * (rows - y0) - (y1 - y0) * (columns - x0) >= 0
    return inside


def painted(mask: Mask, colour: Sequence[int] = (255, 170, 60)) -> Pixels:
    """Opaque fire of one sRGB colour where ``mask`` is."""
    pixels = np.zeros((*mask.shape, 4), np.float32)
    pixels[mask] = (*srgb_to_linear(np.array(colour) / 255), 1.0)
    return pixels


def clip_of(frames: Sequence[Pixels], fps: float = 24.0, matte: str = "alpha") -> Clip:
    """Return a clip of frames that are kept."""
    height, width = frames[0].shape[:2]
    return Clip(
        width=width,
        height=height,
        fps=fps,
        count=len(frames),
        picture=lambda i: frames[i].copy(),
        inputs=(),
        blend_space="srgb",
        matte=matte,
        matte_reason="made so",
    )


@lru_cache(maxsize=8)  # 15 MB each on average
def swaying(
    count: int = 32, half: float = 20.0, reach: float = 8.0, lean: float = 0.0
) -> tuple[Clip, tuple[float, ...]]:
    """A kite that sways ``reach`` degrees about ``lean``, twice; and its lean in every frame."""
    steps = (4 * math.pi * (i + 0.5) / count for i in range(count))
    leans = tuple(lean + reach * math.sin(step) for step in steps)
    return clip_of([painted(kite(each, half)) for each in leans]), leans


def cells_of(size: int, colour: Callable[[int, int], Sequence[int]]) -> tuple[Pixels, Mask, Bytes]:
    """A block of ``size`` by ``size`` cells of 12 x 16 px, each of a colour of its own."""
    table = np.array([[colour(r, c) for c in range(size)] for r in range(size)], np.uint8)
    block = np.repeat(np.repeat(table, 16, axis=0), 12, axis=1)
    mask = np.zeros((HEIGHT, WIDTH), np.bool_)
    mask[30 : 30 + block.shape[0], 40 : 40 + block.shape[1]] = True
    pixels = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    pixels[30 : 30 + block.shape[0], 40 : 40 + block.shape[1], :3] = srgb_to_linear(block / 255)
    pixels[..., 3] = mask
    return pixels, mask, table
