"""Estimate the motion vectors of an animation, as far as held-out frames bear them out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.cells import PAD, PAD_SHARE, cell_vectors
from fire_atlas.channels.cross_validation import ValidationReport, cross_validate
from fire_atlas.channels.encoding import MotionEncoding
from fire_atlas.channels.flow import StepMotion, step_motion
from fire_atlas.channels.held_out import hold_out, reliability
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers

_SCALE_PERCENTILE = 99.5
"""Percentile of a frame's vectors that has to fit into the scale; the few beyond are cut to it."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion vectors of every frame of an animation, at a small size.

    Attributes:
        width, height: Of a frame, px.
        cells: (h, w, 2) of each frame, px of the full-size frame a frame; the planes cover the
            whole frame.
        longest: Length of the longest vectors along x and along y, px a frame, save outliers.
        validation: How close the vectors come to held-out frames; None where the animation is too
            short to hold one out.
    """

    width: int
    height: int
    cells: tuple[NDArray[np.float16], ...]
    longest: tuple[float, float]
    validation: ValidationReport | None

    def frames(self) -> "list[FrameMotion]":
        """Return the frames, in playing order."""
        return [FrameMotion(self, i) for i in range(len(self.cells))]


class FrameMotion(NamedTuple):
    """One frame of an animation, by its number, and the motion of that animation."""

    motion: Motion
    number: int


def estimate_motion(
    pictures: Sequence[Bytes],
    skipped: Mapping[int, tuple[float, Bytes]],
    size: tuple[int, int],
    loop: bool,
    encoding: MotionEncoding,
    workers: Workers,
    advance: Callable[[], None],
) -> Motion:
    """Return the motion of an animation; all 0 where it does not help on held-out frames.

    Args:
        pictures: Every frame, small, as of ``channels.flow.displayed_thumbnail``.
        skipped: By frame, of some, what the source shows between it and the next, small, and
            after how much of the step.
        size: Width and height of a frame, px.
        loop: Whether the first frame follows the last.
        encoding: How the engine encodes vectors, for the validation.
        workers: The pool.
        advance: Called as often as there are frames.
    """
    height, width = pictures[0].shape[:2]
    count = len(pictures)
    pad = max(PAD, PAD_SHARE * max(size)) * max(width / size[0], height / size[1])
    held_out = hold_out(pictures, skipped, loop, pad, workers)
    validation = cross_validate(held_out, encoding)
    reliable = reliability(held_out, (height, width))
    if validation is None or not validation.helps:
        reliable[:] = 0
    unit = np.array([size[0] / width, size[1] / height], np.float32)
    steps = _steps(pictures, loop, workers, advance)

    def cell(i: int) -> NDArray[np.float16]:
        if steps[i] is None:  # nothing follows: an engine that stays here must find it still
            return np.zeros((height, width, 2), np.float16)
        before = steps[i - 1]  # of the first frame the last step: none, unless the clip closes
        near = pictures[i if before is None else i - 1], pictures[i], pictures[(i + 1) % count]
        return (cell_vectors((before, steps[i]), near, reliable, pad) * unit).astype(np.float16)

    cells = tuple(workers.map(cell, range(count)))
    return Motion(*size, cells, _longest(cells), validation)


def _steps(
    pictures: Sequence[Bytes], loop: bool, workers: Workers, advance: Callable[[], None]
) -> list[StepMotion | None]:
    """Return the motion from each picture to the one that follows; None where none does."""
    count = len(pictures)
    closes = loop and count > 1
    last = count if closes else count - 1
    steps: list[StepMotion | None] = []
    for step in workers.map(
        lambda i: step_motion(pictures[i], pictures[(i + 1) % count]), range(last)
    ):
        steps.append(step)
        advance()
    if not closes:
        steps.append(None)
        advance()
    return steps


def _longest(cells: Sequence[NDArray[np.float16]]) -> tuple[float, float]:
    x, y = np.max(
        [np.percentile(np.abs(each), _SCALE_PERCENTILE, axis=(0, 1)) for each in cells], axis=0
    )
    return float(x), float(y)
