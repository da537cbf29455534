"""Hold frames out of a clip, and measure on them how reliable its motion vectors are.

If the source has frames between those that are shown, these are held out. They are the best test: a
flame that sways to and fro between two frames looks still in both. Otherwise frame m is held out
and predicted from m − 1 and m + 1 by vectors found without it; such a step is twice as long as
those that will be played.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.maps.vectors.cells import cell_vectors
from fire_atlas.maps.vectors.flow import StepMotion, Vectors, step_motion
from fire_atlas.vision.sampling import evenly_spread
from fire_atlas.vision.warp import warp_by_pixels

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


class HeldOutFrame(NamedTuple):
    """A frame that was held out, and the frames before and after it with their vectors.

    Attributes:
        before, actual, after: (h, w, 4) uint8; ``actual`` is the frame that was held out.
        vectors: Those of ``before`` and of ``after``, (h, w, 2): px from ``before`` to ``after``,
            as if fully reliable.
        span: Frames of the clip from ``before`` to ``after``, 1 or 2.
        blend: The engine's blend factor at the time of ``actual``: 0 at ``before``, 1 at ``after``.
    """

    before: Bytes
    actual: Bytes
    after: Bytes
    vectors: tuple[Vectors, Vectors]
    span: int
    blend: float

    def predicted(self, vectors: tuple[Vectors, Vectors]) -> NDArray[np.float32]:
        """Return the frame that the engine's formula gives at that time, (h, w, 4), 0..255."""
        one = warp_by_pixels(self.before.astype(np.float32), vectors[0], -self.blend)
        other = warp_by_pixels(self.after.astype(np.float32), vectors[1], 1 - self.blend)
        return self.blended(one, other)

    def blended(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the blend of two pictures at that time."""
        return as_plane(one + (other - one) * np.float32(self.blend))


def choose_held_out(numbers: Sequence[int]) -> list[int]:
    """Return the frames to hold out: an evenly spread choice of ``numbers``, in order."""
    return [numbers[i] for i in evenly_spread(0, len(numbers) - 1, _MAX_HELD_OUT)]


def hold_out(
    pictures: Sequence[Bytes],
    skipped: Mapping[int, tuple[float, Bytes]],
    loop: bool,
    pad: float,
    workers: Workers,
) -> list[HeldOutFrame]:
    """Hold out frames evenly spread over the clip; none if it has fewer than three.

    Args:
        pictures: Every frame of the clip, (h, w, 4) uint8.
        skipped: By frame number, the time (0..1) and the picture of a source frame between it and
            the next. If there are any, these are held out.
        loop: Whether the first frame follows the last.
        pad: Distance from the flame at which vectors begin to fade, px.
        workers: Estimate motion in parallel.
    """
    if skipped:
        return list(workers.map(
            lambda i: _held_out(*skipped[i], i, 1, pictures, loop, pad), sorted(skipped)
        ))  # fmt: skip
    count = len(pictures)
    middles = range(count if count > 2 else 0) if loop else range(1, count - 1)
    return list(workers.map(
        lambda m: _held_out(0.5, pictures[m], m - 1, 2, pictures, loop, pad),
        choose_held_out(middles),
    ))  # fmt: skip


def reliability(held_out: Sequence[HeldOutFrame], shape: tuple[int, int]) -> Plane:
    """Return by what to scale the vectors in each place to predict held-out frames best, (h, w).

    Scales lie in 0..1. Errors are measured at several of them; the best lies at the minimum of the
    parabola through the smallest error and its neighbours. Without held-out frames it is 0.
    """
    if not held_out:
        return np.zeros(shape, np.float32)
    totals = np.zeros((_SCALES, *shape), np.float32)
    for frame in held_out:
        for total, scale in zip(totals, np.linspace(0, 1, _SCALES, dtype=np.float32), strict=True):
            vectors = frame.vectors[0] * scale, frame.vectors[1] * scale
            total += squared_error(frame.predicted(vectors), frame.actual)
    sigma = _ERROR_SIGMA * max(shape)
    errors = np.stack([
        cv2.GaussianBlur(total, (0, 0), sigma)
        + np.float32(_PRIOR_WEIGHT * total.mean(dtype=np.float64))
        for total in totals
    ])  # fmt: skip
    gain = _HALF_STEP_GAIN if held_out[0].span == 2 else 1.0
    return as_plane(np.clip(gain * _best_scale(errors), 0, 1))


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
    return as_plane(np.mean((predicted - actual) ** 2, axis=2))


def _held_out(
    blend: float,
    actual: Bytes,
    first: int,
    span: int,
    pictures: Sequence[Bytes],
    loop: bool,
    pad: float,
) -> HeldOutFrame:
    """Return ``actual`` with the frames ``first`` and ``first + span`` beside it."""
    count = len(pictures)

    def shown(i: int) -> Bytes:
        return pictures[i % count if loop else min(max(i, 0), count - 1)]

    def step(i: int) -> StepMotion | None:
        known = loop or (i >= 0 and i + span < count)
        return step_motion(shown(i), shown(i + span)) if known else None

    at = first - span, first, first + span, first + 2 * span
    into, across, out = (step(i) for i in at[:3])
    earlier, before, after, later = (shown(i) for i in at)
    fully_reliable = np.ones(actual.shape[:2], np.float32)
    vectors = (
        cell_vectors((into, across), (earlier, before, after), fully_reliable, pad),
        cell_vectors((across, out), (before, after, later), fully_reliable, pad),
    )
    return HeldOutFrame(before, actual, after, vectors, span, blend)
