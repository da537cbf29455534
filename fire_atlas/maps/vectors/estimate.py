"""Estimate the motion vectors of an animation by the better of two methods, scaled by their
reliability on held-out frames."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane
from fire_atlas.core.workers import Workers
from fire_atlas.maps.vectors.cells import PAD, PAD_SHARE, cell_vectors
from fire_atlas.maps.vectors.cross_validation import (
    Residuals,
    ValidationReport,
    better_method,
    helps,
    residuals,
    two_fold,
)
from fire_atlas.maps.vectors.encoding import MotionEncoding
from fire_atlas.maps.vectors.flow import Method, Vectors
from fire_atlas.maps.vectors.held_out import (
    for_half_the_step,
    gaps_of_fewer,
    gaps_to_test,
    hold_out,
    reliability,
)
from fire_atlas.maps.vectors.steps import Steps

_FEWER = 2, 5
"""How many times fewer frames may be played, for the statistics."""

_SCALE_PERCENTILE = 99.5
"""Percentile of a frame's vectors that has to fit into the scale; longer ones are clipped to it."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion vectors of every frame of an animation, at a small size.

    Attributes:
        width, height: Size of a frame, px.
        cells: One array per frame, (h, w, 2), at thumbnail resolution. Vectors are in full-size px
            per frame.
        longest: Maximum length of vectors along x and along y, px per frame, without outliers.
        validation: Result of the cross-validation; None if the animation is too short for it.
        tiles: Whether the right side of a frame joins its left one.
    """

    width: int
    height: int
    cells: tuple[NDArray[np.float16], ...]
    longest: tuple[float, float]
    validation: ValidationReport | None
    tiles: bool = False

    def frames(self) -> "list[FrameVectors]":
        """Return the frames, in playing order."""
        size = self.width, self.height
        return [FrameVectors(cell, *size, tiles=self.tiles) for cell in self.cells]


class FrameVectors(NamedTuple):
    """The vectors of one frame, at a small size."""

    cells: NDArray[np.float16]
    """(h, w, 2), px of the frame at full size."""
    width: int
    """Width of the part of the frame that they cover, px."""
    height: int
    """Height of that part, px."""
    tiles: bool = False
    """Whether its right side joins its left one."""


def estimate_motion(
    pictures: Sequence[Bytes],
    skipped: Mapping[int, tuple[float, Bytes]],
    size: tuple[int, int],
    loop: bool,
    encoding: MotionEncoding,
    workers: Workers,
    advance: Callable[[], None],
    margin: int = 0,
) -> Motion:
    """Return the motion of an animation; all vectors are 0 if they do not help on held-out frames.

    Args:
        pictures: Every frame, made by ``channels.flow.displayed_thumbnail``.
        skipped: By frame number, the time (0..1) and the picture of a source frame between it and
            the next, as far as there are any.
        size: Width and height of a frame, px.
        loop: Whether the first frame follows the last.
        encoding: How the engine encodes vectors, for the validation.
        workers: Estimate motion in parallel.
        advance: Called once per frame, to show progress.
        margin: Columns at both sides of the pictures that are beyond the frame, of a tile.
    """
    height, columns = pictures[0].shape[:2]
    width, count = columns - 2 * margin, len(pictures)
    pad = max(PAD, PAD_SHARE * max(size)) * max(width / size[0], height / size[1])
    best = _better(pictures, skipped, loop, pad, encoding, workers)
    if best is None or not best.report.helps:
        for _ in pictures:
            advance()
        still = tuple(np.zeros((height, width, 2), np.float16) for _ in pictures)
        return Motion(*size, still, (0.0, 0.0), best and best.report, tiles=margin > 0)
    steps = best.steps
    steps.estimate(steps.played(), advance)
    if not loop:
        advance()
    unit = np.array([size[0] / width, size[1] / height], np.float32)

    def cell(i: int) -> NDArray[np.float16]:
        if not loop and i == count - 1:  # an engine that stops here shows this frame
            return np.zeros((height, width, 2), np.float16)
        vectors = cell_vectors(steps, i, 1, best.reliable, pad)
        return (_joined(vectors, margin) * unit).astype(np.float16)

    cells = tuple(workers.map(cell, range(count)))
    return Motion(*size, cells, longest_of(cells), best.report, tiles=margin > 0)


class _Trial(NamedTuple):
    """How one method does on held-out frames.

    Attributes:
        steps: The motion, as far as it is kept.
        reliable: (h, w), by what to scale its vectors over the steps that were tested.
        left: What it leaves of those to be played.
        halved: What it leaves with half of the frames, if that is what was tested.
    """

    steps: Steps
    reliable: Plane
    left: Residuals
    halved: Residuals | None


class _Better(NamedTuple):
    """The better method.

    Attributes:
        steps: The motion, as far as it is known by now.
        reliable: (h, w), by what to scale its vectors.
        report: How it does on held-out frames.
    """

    steps: Steps
    reliable: Plane
    report: ValidationReport


def _better(
    pictures: Sequence[Bytes],
    skipped: Mapping[int, tuple[float, Bytes]],
    loop: bool,
    pad: float,
    encoding: MotionEncoding,
    workers: Workers,
) -> _Better | None:
    """Try both methods on held-out frames; None if there are none. See ``estimate_motion``."""
    gaps, double = gaps_to_test(pictures, skipped, loop), not skipped
    if not gaps:
        return None

    trials = dict[Method, _Trial]()
    for method in get_args(Method)[::-1]:  # DIS stays more often: its steps are kept, to be played
        steps = Steps(pictures, loop, method, workers)
        held_out = hold_out(gaps, steps, pad, workers)
        steps.forget_all_but(steps.played() if method == "dis" else [])
        tested = two_fold(held_out)
        trials[method] = _Trial(
            steps,
            reliability(held_out, pictures[0].shape[:2]),
            residuals(tested, encoding, steps_are_double=double),
            residuals(tested, encoding) if double else None,
        )
        del held_out, tested  # one method's vectors at a time, for memory
    left = {name: trial.left for name, trial in trials.items()}
    method = better_method(left, steps_are_double=double)
    steps, reliable, best, halved = trials[method]
    trials.clear()
    fewer = {2: halved} if halved is not None else {}
    for times in _FEWER:
        if times not in fewer and (others := gaps_of_fewer(pictures, loop, times)):
            fewer[times] = residuals(two_fold(hold_out(others, steps, pad, workers)), encoding)
            steps.forget_all_but(steps.played())
    report = ValidationReport(
        len(gaps),
        best.gain,
        helps(best, steps_are_double=double),
        method,
        {"blend": best.blend, **{name: left[name].vectors for name in get_args(Method)}},
        fewer,
        best.still,
    )
    return _Better(steps, for_half_the_step(reliable) if double else reliable, report)


def _joined(vectors: Vectors, margin: int) -> Vectors:
    """Return vectors (h, w, 2) without the ``margin`` at both sides, which copies what is inside:
    near its sides each is mixed with its copy, as no two estimates are alike."""
    width = vectors.shape[1] - 2 * margin
    around, near = margin + width, min(margin, width // 2)
    inside = vectors[:, margin:around].copy()
    share = np.linspace(0.5, 0, near, dtype=np.float32)[:, None]
    inside[:, :near] += share * (vectors[:, around : around + near] - inside[:, :near])
    last = width - near
    inside[:, last:] += share[::-1] * (vectors[:, margin - near : margin] - inside[:, last:])
    return inside


def longest_of(cells: Sequence[NDArray[np.float16]]) -> tuple[float, float]:
    """Return the maximum length of vectors (h, w, 2) of frames along x and y, without outliers."""
    x, y = np.max(
        [np.percentile(np.abs(vectors), _SCALE_PERCENTILE, axis=(0, 1)) for vectors in cells],
        axis=0,
    )
    return float(x), float(y)
