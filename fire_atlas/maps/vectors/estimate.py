"""Estimate the motion vectors of an animation, scaled by their reliability on held-out frames."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.maps.vectors.cells import PAD, PAD_SHARE, cell_vectors
from fire_atlas.maps.vectors.cross_validation import ValidationReport, cross_validate
from fire_atlas.maps.vectors.encoding import MotionEncoding
from fire_atlas.maps.vectors.flow import StepMotion, Vectors, step_motion
from fire_atlas.maps.vectors.held_out import hold_out, reliability

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
    held_out = hold_out(pictures, skipped, loop, pad, workers)
    validation = cross_validate(held_out, encoding)
    reliable = reliability(held_out, (height, columns))
    if validation is None or not validation.helps:
        reliable[:] = 0
    unit = np.array([size[0] / width, size[1] / height], np.float32)
    steps = _steps(pictures, loop, workers, advance)

    def cell(i: int) -> NDArray[np.float16]:
        if steps[i] is None:  # the last frame of a one-shot: an engine that stops here shows it
            return np.zeros((height, width, 2), np.float16)
        before = steps[i - 1]  # for the first frame the last step, which is None in a one-shot
        near = pictures[i if before is None else i - 1], pictures[i], pictures[(i + 1) % count]
        vectors = cell_vectors((before, steps[i]), near, reliable, pad)
        return (_joined(vectors, margin) * unit).astype(np.float16)

    cells = tuple(workers.map(cell, range(count)))
    return Motion(*size, cells, longest_of(cells), validation, tiles=margin > 0)


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


def _steps(
    pictures: Sequence[Bytes], loop: bool, workers: Workers, advance: Callable[[], None]
) -> list[StepMotion | None]:
    """Return the motion from each picture to the next one; None after the last of a one-shot."""
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


def longest_of(cells: Sequence[NDArray[np.float16]]) -> tuple[float, float]:
    """Return the maximum length of vectors (h, w, 2) of frames along x and y, without outliers."""
    x, y = np.max(
        [np.percentile(np.abs(vectors), _SCALE_PERCENTILE, axis=(0, 1)) for vectors in cells],
        axis=0,
    )
    return float(x), float(y)
