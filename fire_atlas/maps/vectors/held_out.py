"""Hold frames out of a clip, and measure on them how reliable its motion vectors are.

If the source has frames between those that are shown, these are held out. They are the best test: a
flame that sways to and fro between two frames looks still in both. Otherwise frame m is held out
and predicted from m − 1 and m + 1 by vectors found without it; such a step is twice as long as
those that will be played. And as if only every n-th frame were played, others are held out.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.maps.vectors.cells import cell_vectors
from fire_atlas.maps.vectors.flow import Vectors
from fire_atlas.maps.vectors.steps import Step, Steps
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.warp import over_channels, warp_by_pixels

_MAX_HELD_OUT = 8
"""Maximum number of frames of a clip that are held out."""

_ERROR_SIGMA = 1 / 16
"""Standard deviation of the Gaussian that averages errors, as a fraction of the longer side."""

_SCALES = 5
"""How many scales of the vectors are tried, evenly spread from 0 to 1."""

_PRIOR_WEIGHT = 0.5
"""Weight of the whole picture's mean error beside the local one."""

_HALF_STEP_GAIN = 2.0
"""Factor that corrects reliability measured over two frames to a step of one: the longer step's two
frames of fire have less in common. The product is limited to 1."""


class Gap(NamedTuple):
    """A place between two frames of an animation at which a frame is held out.

    Attributes:
        actual: (h, w, 4) uint8, the frame that is held out.
        first: Number of the frame before it.
        span: Frames of the animation from that one to the next, which is there again.
        blend: The engine's blend factor at the time of ``actual``: 0 at the frame before, 1 at the
            next.
    """

    actual: Bytes
    first: int
    span: int
    blend: float

    def frames(self) -> tuple[int, int]:
        """Return the numbers of the frame before and of the next."""
        return self.first, self.first + self.span

    def steps(self) -> list[Step]:
        """Return the steps before, over and after the gap."""
        starts = (self.first + self.span * i for i in (-1, 0, 1))
        return [(start, start + self.span) for start in starts]


class HeldOutFrame(NamedTuple):
    """A frame that was held out, and the frames before and after it with their vectors.

    Attributes:
        before, actual, after: (h, w, 4) uint8; ``actual`` is the frame that was held out.
        vectors: Those of ``before`` and of ``after``, (h, w, 2): px from ``before`` to ``after``,
            as if fully reliable.
        blend: The engine's blend factor at the time of ``actual``: 0 at ``before``, 1 at ``after``.
    """

    before: Bytes
    actual: Bytes
    after: Bytes
    vectors: tuple[Vectors, Vectors]
    blend: float

    def blended(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the blend of two pictures at that time."""
        return as_plane(one + (other - one) * np.float32(self.blend))

    def errors(self, scales: NDArray[np.float32]) -> Iterator[Plane]:
        """Yield the squared error, (h, w), of what the engine's formula gives at that time with the
        vectors times each of these ``scales``."""
        before, after = self.before.astype(np.float32), self.after.astype(np.float32)
        for scale in scales:
            one = warp_by_pixels(before, self.vectors[0] * scale, -self.blend)
            other = warp_by_pixels(after, self.vectors[1] * scale, 1 - self.blend)
            yield squared_error(self.blended(one, other), self.actual)


def choose_held_out(numbers: Sequence[int]) -> list[int]:
    """Return the frames to hold out: an evenly spread choice of ``numbers``, in order."""
    return [numbers[i] for i in evenly_spread(0, len(numbers) - 1, _MAX_HELD_OUT)]


def gaps_to_test(
    pictures: Sequence[Bytes], skipped: Mapping[int, tuple[float, Bytes]], loop: bool
) -> list[Gap]:
    """Choose frames to hold out, evenly spread; none of fewer than three.

    Args:
        pictures: Every frame of the animation, (h, w, 4) uint8.
        skipped: By frame number, the time (0..1) and the picture of a source frame between it and
            the next. If there are any, these are held out.
        loop: Whether the first frame follows the last.
    """
    if skipped:
        return [Gap(skipped[i][1], i, 1, skipped[i][0]) for i in sorted(skipped)]
    count = len(pictures)
    middles = range(count if count > 2 else 0) if loop else range(1, count - 1)
    return [Gap(pictures[m], m - 1, 2, 0.5) for m in choose_held_out(middles)]


def gaps_of_fewer(pictures: Sequence[Bytes], loop: bool, factor: int) -> list[Gap]:
    """Choose frames to hold out where one in ``factor`` is played: all between two that are, of
    evenly spread steps; none if fewer than three are played. The steps take turns."""
    count = len(pictures)
    if count <= 2 * factor:
        return []
    steps = range(0, count - factor + 1 if loop else count - factor, factor)
    chosen = evenly_spread(0, len(steps) - 1, _MAX_HELD_OUT // (factor - 1))
    return [
        Gap(pictures[steps[i] + part], steps[i], factor, part / factor)
        for part in range(1, factor)
        for i in chosen
    ]


def hold_out(gaps: Sequence[Gap], steps: Steps, pad: float, workers: Workers) -> list[HeldOutFrame]:
    """Return the frames held out at ``gaps``, with the vectors of their neighbours.

    Args:
        gaps: Where frames are held out.
        steps: The motion of the animation; what is not known of it yet is estimated.
        pad: Distance from the flame at which vectors begin to fade, px.
        workers: Make the vectors in parallel.
    """
    steps.estimate(step for gap in gaps for step in gap.steps())
    fully = np.ones(gaps[0].actual.shape[:2], np.float32)
    cells = dict.fromkeys((frame, gap.span) for gap in gaps for frame in gap.frames())
    made = workers.map(lambda cell: cell_vectors(steps, *cell, fully, pad), cells)
    vectors = dict(zip(cells, made, strict=True))
    return [
        HeldOutFrame(
            steps.picture(before), gap.actual, steps.picture(after),
            (vectors[before, gap.span], vectors[after, gap.span]), gap.blend,
        )
        for gap in gaps
        for before, after in [gap.frames()]
    ]  # fmt: skip


def reliability(held_out: Sequence[HeldOutFrame], shape: tuple[int, int]) -> Plane:
    """Return by what to scale the vectors in each place to predict held-out frames best, (h, w).

    Scales lie in 0..1. Errors are measured at several of them; the best lies at the minimum of the
    parabola through the smallest error and its neighbours. Without held-out frames it is 0.
    """
    if not held_out:
        return np.zeros(shape, np.float32)
    totals = np.zeros((_SCALES, *shape), np.float32)
    scales = np.linspace(0, 1, _SCALES, dtype=np.float32)
    for frame in held_out:
        for total, error in zip(totals, frame.errors(scales), strict=True):
            total += error
    sigma = _ERROR_SIGMA * max(shape)
    errors = np.stack([
        cv2.GaussianBlur(total, (0, 0), sigma)
        + np.float32(_PRIOR_WEIGHT * total.mean(dtype=np.float64))
        for total in totals
    ])  # fmt: skip
    return _best_scale(errors)


def for_half_the_step(scale: Plane) -> Plane:
    """Return the reliability over steps of half the length that it was measured over."""
    return as_plane(np.clip(_HALF_STEP_GAIN * scale, 0, 1))


def _best_scale(errors: NDArray[np.float32]) -> Plane:
    """Return the scale, 0..1, at which ``errors`` (scales, h, w) are smallest in each place."""
    last = len(errors) - 1
    least = np.argmin(errors, axis=0)
    middle = np.clip(least, 1, last - 1)
    low, here, high = (
        np.take_along_axis(errors, (middle + n)[None], axis=0)[0] for n in (-1, 0, 1)
    )
    curve = low - 2 * here + high
    bent = curve > 1e-6 * here
    beside = np.where(bent, (low - high) / (2 * np.where(bent, curve, 1)), least - middle)
    at_end = least != middle  # no parabola: there is no neighbour beyond the ends
    return as_plane(np.where(at_end, least, middle + np.clip(beside, -1, 1)) / np.float32(last))


def squared_error(predicted: NDArray[np.float32], actual: Bytes) -> Plane:
    """Return the mean squared difference (h, w) over the channels."""
    return as_plane(over_channels((predicted - actual) ** 2) / 4)
