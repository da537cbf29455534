"""Whether variants of a fire ever look like copies: by the drawings on the pages of a build."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import common_canvas
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.preview.cut_frames import cut_frames

APART = 0.5
"""Time within which no two variants may show the same drawing, s."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two variants of a fire that are played side by side.

    Attributes:
        one, other: Their animations.
        mirrored: Whether the second is shown as its mirror image.
        distance: Root mean square difference of the two drawings that are most alike among those
            that both show within half a second, from whatever moments and at whatever speeds they
            begin, in median steps from frame to frame.
    """

    one: str
    other: str
    mirrored: bool
    distance: float


def pairs_of(path: Path) -> Iterator[Pair]:
    """Yield every pair of variants of the fires in an atlas, by its JSON.

    A player may begin a loop at any moment and at a speed of its own, so that sooner or later any
    drawing of one is shown within half a second of any drawing of the other: all are compared.
    """
    atlas = read_atlas(path)
    regions = {region.name: region for region in atlas.frames}
    frames = cut_frames(atlas)
    fires = defaultdict[str, dict[str, NDArray[np.float32]]](dict)
    for animation in atlas.sheet.animations:
        shown = [regions[name] for name in animation.frames]
        (width, height), places = common_canvas(shown)
        drawn = np.zeros((len(shown), height, width, 4), np.float32)
        for canvas, (x, y) in zip(drawn, places, strict=True):
            frame = next(frames).astype(np.float32)
            if atlas.sheet.alpha == "straight":
                frame[..., :3] *= frame[..., 3:] / 255
            canvas[y : y + frame.shape[0], x : x + frame.shape[1]] = frame
        if animation.variant is not None:
            fire = animation.stem.rpartition("/")[0] + animation.name.removeprefix(animation.stem)
            fires[fire][animation.name] = drawn
    for variants in fires.values():
        for (one, a), (other, b) in combinations(variants.items(), 2):
            step = float(np.median([*_steps(a), *_steps(b)]))
            for mirrored in (False, True):
                c = b[:, :, ::-1] if mirrored else b
                yield Pair(one, other, mirrored, _least(a, c) / max(step, 1e-9))


def _steps(drawn: NDArray[np.float32]) -> list[float]:
    return [float(np.sqrt(np.mean((a - b) ** 2))) for a, b in pairwise(drawn)]


def _least(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    return min(float(np.sqrt(np.mean((a - b) ** 2))) for a in one for b in other)
