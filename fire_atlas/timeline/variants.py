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
    frames = small_copies(clip, workers)
    for number in range(variants, 1, -1):
        cuts = list(_cuts(clip.count, clip.fps, number))
        parts = [frames[cut.start : cut.stop] for cut in cuts]
        if not any(show_the_same(*pair) for pair in combinations(parts, 2)):
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


def require_apart(
    earlier: Sequence[NDArray[np.float32]], variant: NDArray[np.float32], stem: str
) -> None:
    """Refuse a generated variant that shows a drawing of an earlier one, by small copies of their
    frames.

    Raises:
        RecipeError: It does; what is learnt of a short clip is shown again. Its message has the
            largest number.
    """
    for number, other in enumerate(earlier):
        if show_the_same(other, variant):
            raise RecipeError(
                f"{stem} shows a drawing of v{number} again, as what is learnt of a short clip "
                f"does: {_largest(len(earlier))}, or learn from a longer clip",
                key=("variants",),
            )


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


def small_copies(clip: Clip, workers: Workers) -> NDArray[np.float32]:
    """Return small copies of all frames of a clip, by which drawings are compared, (n, h, w, 4)."""
    return np.stack(list(workers.map(lambda i: shrunk(clip.read(i), _SIDE), range(clip.count))))


def show_the_same(one: NDArray[np.float32], other: NDArray[np.float32]) -> bool:
    """Return whether two loops show the same drawing, or its mirror image, by small copies of their
    frames, (n, h, w, 4) each."""
    if one.shape[1:] != other.shape[1:]:
        return False
    steps = np.sqrt(np.mean(np.diff(one, axis=0) ** 2, axis=(1, 2, 3)))
    drawn = steps[steps > _SAME * steps.max()] if len(steps) else steps
    same = _SAME * (float(np.median(drawn)) if len(drawn) else 0.0)
    mean = one.mean(axis=0)
    rows, *others = (
        (frames - mean).reshape(len(frames), -1) for frames in (one, other, other[:, :, ::-1])
    )
    return any(_least_distance(rows, each) <= same for each in others)


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
