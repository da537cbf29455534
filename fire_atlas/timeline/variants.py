"""Cut several fires out of one clip, of which no two ever show the same drawing."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.workers import Workers
from fire_atlas.timeline.looping import why_one_shot
from fire_atlas.vision.thumbnails import shrunk

APART = 0.5
"""Time of a clip between any two of its cuts, s: what is nearer shows one movement of its fire."""

_LEAST_SECONDS, _LEAST_FRAMES = 1.0, 8
"""Of a cut: a shorter loop is seen to repeat."""

_SIDE = 48
"""Longest side, px, of the copies by which drawings are compared."""

_SAME = 0.25
"""Distance of two frames that show one drawing, in median steps from frame to frame."""


def cut_apart(clip: Clip, variants: int, workers: Workers) -> list[Clip]:
    """Return so many cuts of a clip, one after the other and half a second apart, of which no two
    show the same drawing, or its mirror image.

    Raises:
        RecipeError: The clip plays once, or is too short; its message has the largest number.
    """
    key = ("variants",)
    check_variants(clip.count, clip.fps, variants)
    if why := why_one_shot(clip, workers):
        raise RecipeError(
            f"are cuts of a clip that burns on, but {why}; remove variants, or make fire that "
            f"plays once with source.kind: fluid",
            key=key,
        )
    rows = _small_rows(clip, workers)
    for number in range(variants, 1, -1):
        cuts = list(_cuts(clip.count, clip.fps, number))
        if _are_apart(rows, cuts):
            break
    else:
        number = 1
    if number < variants:
        raise RecipeError(
            f"are cuts of the clip of which no two show the same drawing, but it shows drawings "
            f"again: {_largest(number)}",
            key=key,
        )
    return [_section(clip, cut) for cut in cuts]


def check_variants(count: int, fps: float, variants: int) -> None:
    """Refuse more variants than a clip of ``count`` frames is long enough for.

    Raises:
        RecipeError: There are too many.
    """
    largest = count // (_least(fps) + _gap(fps))
    if variants > 1 and variants > largest:
        raise RecipeError(
            f"{variants} cuts of {_least(fps)} frames or more, half a second apart, need "
            f"{variants * (_least(fps) + _gap(fps))} frames, and the clip has {count}: "
            f"{_largest(max(largest, 1))}",
            key=("variants",),
        )


def _largest(variants: int) -> str:
    if variants == 1:
        return "it is enough for one; remove variants, or use a longer clip"
    return f"the largest number is {variants}"


def _least(fps: float) -> int:
    return max(_LEAST_FRAMES, math.ceil(_LEAST_SECONDS * fps))


def _gap(fps: float) -> int:
    return math.ceil(APART * fps)


def _cuts(count: int, fps: float, variants: int) -> Iterator[range]:
    """Yield the frames of each cut. As the clip may be a loop, there is a gap after the last."""
    length = count // variants - _gap(fps)
    for first in range(variants):
        start = first * count // variants
        yield range(start, start + length)


def _small_rows(clip: Clip, workers: Workers) -> NDArray[np.float32]:
    """Return small copies of all frames and their mirror images, (2, frames, values)."""
    small = np.stack(list(workers.map(lambda i: shrunk(clip.read(i), _SIDE), range(clip.count))))
    pair = np.stack([small, small[:, :, ::-1]])
    rows: NDArray[np.float32] = (pair - small.mean(axis=0)).reshape(2, clip.count, -1)
    return rows


def _are_apart(rows: NDArray[np.float32], cuts: Sequence[range]) -> bool:
    """Return whether no two cuts show the same drawing, or its mirror image."""
    steps = np.sqrt(np.mean(np.diff(rows[0], axis=0) ** 2, axis=1))
    drawn = steps[steps > _SAME * steps.max()]
    same = _SAME * (float(np.median(drawn)) if len(drawn) else 0.0)
    for one, other in combinations(cuts, 2):
        for mirrored in rows:
            if _least_distance(rows[0][one], mirrored[other]) <= same:
                return False
    return True


def _least_distance(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Return the least root mean square difference of rows (n, values) of two sets."""
    # ‖a − b‖² = ‖a‖² + ‖b‖² − 2ab
    power = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1)[None]
    square = np.maximum(power - 2 * one @ other.T, 0) / one.shape[1]
    return float(np.sqrt(square.min()))


def _section(clip: Clip, cut: range) -> Clip:
    """Return the frames of a cut as a clip that has an end."""
    flow, skipped = clip.flow, clip.skipped
    return replace(
        clip,
        count=len(cut),
        picture=lambda i: clip.picture(cut[i]),
        loop=False,
        flow=None if flow is None else lambda i: flow(cut[i]),
        skipped={i: skipped[at] for i, at in enumerate(cut) if at in skipped and at + 1 in cut},
    )
