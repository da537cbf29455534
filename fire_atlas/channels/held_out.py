"""What frames that were held out say of a clip's motion: how far to trust it, and what it gains.

Where the source has frames between those that are shown, they are what vectors have to meet, and
nothing else is as good a witness: a flame that sways to and fro between two frames looks calm in
them. Else frame m is predicted from m − 1 and m + 1 by vectors that were found without it, over
steps of two frames. In that the clip is twice as fast as it will be played.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.channels.cells import cell_vectors
from fire_atlas.channels.flow import Halfway, Vectors, halfway, warped
from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.core.workers import Workers

_MOST = 8
"""Most frames of a clip that are held out."""

_BLOCK = 1 / 16
"""Size of the blocks that are judged, as a share of the longer side."""

_SHARES = 5
"""Shares of a vector that are tried, from none to all of it."""

_PRIOR = 0.5
"""What the whole picture says counts in every block like so many blocks of average error."""

_HALF_THE_STEP = 2.0
"""Trust in a step is so many times what served best over twice that step, 1 at most: fire loses
its coherence with the time that passes."""


class HeldOut(NamedTuple):
    """A frame that was held out, and the frames beside it with their vectors.

    Attributes:
        before, held, after: (h, w, 4) uint8.
        vectors: Of ``before`` and of ``after``: (h, w, 2), px of the picture from the one to the
            other, trusted fully.
        frames: How many frames of the clip that is, 1 or 2.
        part: How much of the way from the one to the other is over, 0..1.
    """

    before: Bytes
    held: Bytes
    after: Bytes
    vectors: tuple[Vectors, Vectors]
    frames: int
    part: float

    def predicted(self, vectors: tuple[Vectors, Vectors]) -> NDArray[np.float32]:
        """Return the frame there, (h, w, 4), 0..255, by the client's formula."""
        one = warped(self.before.astype(np.float32), vectors[0], -self.part)
        other = warped(self.after.astype(np.float32), vectors[1], 1 - self.part)
        return self.blended(one, other)

    def blended(self, one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return what two pictures give at that time."""
        return as_plane(one + (other - one) * np.float32(self.part))


def spread(numbers: Sequence[int]) -> list[int]:
    """Return of ``numbers`` as many as are held out, evenly spread."""
    at = np.linspace(0, len(numbers) - 1, min(_MOST, len(numbers)))
    return sorted({numbers[round(n)] for n in at})


def hold_out(
    pictures: Sequence[Bytes],
    skipped: Mapping[int, tuple[float, Bytes]],
    loop: bool,
    pad: float,
    workers: Workers,
) -> list[HeldOut]:
    """Hold out frames evenly spread over the clip; none where it has fewer than three.

    Args:
        pictures: Every frame of the clip.
        skipped: By frame, what the source shows between it and the next, and after how much of
            the step; these are met, if any.
        loop: Whether the first frame follows the last.
        pad: px beyond the flame at which vectors begin to fade.
        workers: The pool.
    """
    if skipped:
        return list(workers.map(
            lambda i: _held(*skipped[i], i, 1, pictures, loop, pad), sorted(skipped)
        ))  # fmt: skip
    count = len(pictures)
    middles = range(count if count > 2 else 0) if loop else range(1, count - 1)
    return list(workers.map(
        lambda m: _held(0.5, pictures[m], m - 1, 2, pictures, loop, pad), spread(middles)
    ))  # fmt: skip


def trust(held: Sequence[HeldOut], shape: tuple[int, int]) -> Plane:
    """Return how far the vectors serve, (h, w), 0..1, block by block.

    Of the errors with several shares of a vector the least is taken, and the lowest point of the
    parabola through it and its neighbours. Without evidence nothing is trusted.
    """
    if not held:
        return np.zeros(shape, np.float32)
    totals = np.zeros((_SHARES, *shape), np.float32)
    for one in held:
        for total, share in zip(totals, np.linspace(0, 1, _SHARES, dtype=np.float32), strict=True):
            vectors = one.vectors[0] * share, one.vectors[1] * share
            total += square_error(one.predicted(vectors), one.held)
    sigma = _BLOCK * max(shape)
    errors = np.stack([
        cv2.GaussianBlur(total, (0, 0), sigma) + np.float32(_PRIOR * total.mean(dtype=np.float64))
        for total in totals
    ])  # fmt: skip
    more = _HALF_THE_STEP if held[0].frames == 2 else 1.0
    return as_plane(np.clip(more * _lowest(errors), 0, 1))


def _lowest(errors: NDArray[np.float32]) -> Plane:
    """Return where, 0..1, each place of ``errors`` (shares, h, w) is least."""
    last = len(errors) - 1
    least = np.argmin(errors, axis=0)
    middle = np.clip(least, 1, last - 1)
    low, here, high = (
        np.take_along_axis(errors, (middle + n)[None], axis=0)[0] for n in (-1, 0, 1)
    )
    curve = low - 2 * here + high
    bent = curve > 1e-6 * here
    beside = np.where(bent, (low - high) / (2 * np.where(bent, curve, 1)), least - middle)
    at_end = least != middle  # beyond the ends nothing was tried
    return as_plane(np.where(at_end, least, middle + np.clip(beside, -1, 1)) / np.float32(last))


def square_error(predicted: NDArray[np.float32], held: Bytes) -> Plane:
    """Return the mean square difference (h, w) over the channels."""
    return as_plane(np.mean((predicted - held) ** 2, axis=2))


def _held(
    part: float,
    held: Bytes,
    first: int,
    frames: int,
    pictures: Sequence[Bytes],
    loop: bool,
    pad: float,
) -> HeldOut:
    """Return ``held`` with the frames ``first`` and ``first + frames`` beside it."""
    count = len(pictures)

    def shown(i: int) -> Bytes:
        return pictures[i % count if loop else min(max(i, 0), count - 1)]

    def step(i: int) -> Halfway | None:
        known = loop or (i >= 0 and i + frames < count)
        return halfway(shown(i), shown(i + frames)) if known else None

    at = first - frames, first, first + frames, first + 2 * frames
    into, across, out = (step(i) for i in at[:3])
    earlier, before, after, later = (shown(i) for i in at)
    everything = np.ones(held.shape[:2], np.float32)
    vectors = (
        cell_vectors((into, across), (earlier, before, after), everything, pad),
        cell_vectors((across, out), (before, after, later), everything, pad),
    )
    return HeldOut(before, held, after, vectors, frames, part)
