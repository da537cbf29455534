"""The motion vectors of one animation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.cells import cell_vectors
from fire_atlas.channels.cross_validation import ValidationReport, cross_validate
from fire_atlas.channels.encoding import MotionEncoding
from fire_atlas.channels.flow import Halfway, halfway
from fire_atlas.channels.held_out import hold_out, reliability
from fire_atlas.channels.margin import PAD, PAD_SHARE
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers

_ENOUGH = 99.5
"""Percentile of a frame's vectors that has to fit into the scale; the few beyond are cut to it."""


@dataclass(frozen=True, slots=True)
class Motion:
    """How each frame of an animation moves, small.

    Attributes:
        width, height: Of a frame, px.
        cells: (h, w, 2) of each frame, px of the frame a frame; its place in the whole frame as in
            a picture of another size.
        reach: How far vectors go along x and along y, px a frame, save for the odd one.
        validation: How close the vectors come to held-out frames; None where the animation is too
            short to hold one out.
    """

    width: int
    height: int
    cells: tuple[NDArray[np.float16], ...]
    reach: tuple[float, float]
    validation: ValidationReport | None

    def frames(self) -> "list[Moving]":
        """Return the frames, in playing order."""
        return [Moving(self, i) for i in range(len(self.cells))]


class Moving(NamedTuple):
    """A frame of an animation, and how that moves."""

    motion: Motion
    frame: int


def learn_motion(
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
        pictures: Every frame, small: see ``channels.flow.picture``.
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
        if steps[i] is None:  # nothing follows: a client that stays here must find it still
            return np.zeros((height, width, 2), np.float16)
        before = steps[i - 1]  # of the first frame the last step: none, unless the clip closes
        near = pictures[i if before is None else i - 1], pictures[i], pictures[(i + 1) % count]
        return (cell_vectors((before, steps[i]), near, reliable, pad) * unit).astype(np.float16)

    cells = tuple(workers.map(cell, range(count)))
    return Motion(*size, cells, _reach(cells), validation)


def _steps(
    pictures: Sequence[Bytes], loop: bool, workers: Workers, advance: Callable[[], None]
) -> list[Halfway | None]:
    """Return the motion from each picture to the one that follows; None where none does."""
    count = len(pictures)
    closes = loop and count > 1
    last = count if closes else count - 1
    steps: list[Halfway | None] = []
    for step in workers.map(lambda i: halfway(pictures[i], pictures[(i + 1) % count]), range(last)):
        steps.append(step)
        advance()
    if not closes:
        steps.append(None)
        advance()
    return steps


def _reach(cells: Sequence[NDArray[np.float16]]) -> tuple[float, float]:
    x, y = np.max([np.percentile(np.abs(each), _ENOUGH, axis=(0, 1)) for each in cells], axis=0)
    return float(x), float(y)
