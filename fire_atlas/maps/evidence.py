"""What frames that were held out say of a clip's motion: how far to trust it, and what it gains.

Frame m is predicted from m − 1 and m + 1 by vectors that were found without it, over steps of two
frames. In that the clip is twice as fast as it will be played.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.maps.cells import cell_vectors
from fire_atlas.maps.flow import Halfway, Vectors, halfway, warped

_MOST = 8
"""Most frames of a clip that are held out."""

_BLOCK = 1 / 16
"""Size of the blocks that are judged, as a share of the longer side."""

_PRIOR = 0.5
"""What the whole picture says counts in every block like so many blocks of average error."""

_HALF_THE_STEP = 2.0
"""Trust in a step is so many times what served best over twice that step, 1 at most: fire loses
its coherence with the time that passes."""


class HeldOut(NamedTuple):
    """A frame that was held out, and the frames beside it with their vectors.

    Attributes:
        before, held, after: (h, w, 4) uint8.
        vectors: Of ``before`` and of ``after``: (h, w, 2), px of the picture for a step of two
            frames, trusted fully.
    """

    before: Bytes
    held: Bytes
    after: Bytes
    vectors: tuple[Vectors, Vectors]

    def predicted(self, vectors: tuple[Vectors, Vectors]) -> NDArray[np.float32]:
        """Return the frame halfway, (h, w, 4), 0..255, by the client's formula."""
        one = warped(self.before.astype(np.float32), vectors[0], -0.5)
        other = warped(self.after.astype(np.float32), vectors[1], 0.5)
        return as_plane((one + other) / 2)


def hold_out(pictures: Sequence[Bytes], loop: bool, pad: float, workers: Workers) -> list[HeldOut]:
    """Hold out frames evenly spread over the clip; none where it has fewer than three."""
    return list(workers.map(lambda m: _held(m, pictures, loop, pad), _spread(len(pictures), loop)))


def trust(held: Sequence[HeldOut], shape: tuple[int, int]) -> Plane:
    """Return how far the vectors serve, (h, w), 0..1, block by block.

    Of the errors with none, half and all of a vector the parabola is taken whose lowest point is
    the share that would have served best. Without evidence nothing is trusted.
    """
    if not held:
        return np.zeros(shape, np.float32)
    totals = [np.zeros(shape, np.float32) for _ in range(3)]
    for one in held:
        for total, share in zip(totals, (0.0, 0.5, 1.0), strict=True):
            vectors = one.vectors[0] * np.float32(share), one.vectors[1] * np.float32(share)
            total += square_error(one.predicted(vectors), one.held)
    sigma = _BLOCK * max(shape)
    none, half, full = (
        cv2.GaussianBlur(total, (0, 0), sigma) + np.float32(_PRIOR * total.mean(dtype=np.float64))
        for total in totals
    )
    curve, slope = 2 * (none - 2 * half + full), 3 * none - 4 * half + full
    bent = curve > 1e-6 * none
    best = np.where(bent, slope / (2 * np.where(bent, curve, 1)), full < none)
    return as_plane(np.clip(_HALF_THE_STEP * np.clip(best, 0, 1), 0, 1))


def square_error(predicted: NDArray[np.float32], held: Bytes) -> Plane:
    """Return the mean square difference (h, w) over the channels."""
    return as_plane(np.mean((predicted - held) ** 2, axis=2))


def _spread(count: int, loop: bool) -> list[int]:
    """Return which frames to hold out: any of a loop, those between two others of the rest."""
    first, last = (0, count - 1) if loop else (1, count - 2)
    if count < 3:
        return []
    return sorted({round(m) for m in np.linspace(first, last, min(_MOST, last - first + 1))})


def _held(m: int, pictures: Sequence[Bytes], loop: bool, pad: float) -> HeldOut:
    count = len(pictures)

    def shown(i: int) -> Bytes:
        return pictures[i % count if loop else min(max(i, 0), count - 1)]

    def step(i: int) -> Halfway | None:
        known = loop or (i >= 0 and i + 2 < count)
        return halfway(shown(i), shown(i + 2)) if known else None

    into, across, out = step(m - 3), step(m - 1), step(m + 1)
    everything = np.ones(shown(m).shape[:2], np.float32)
    vectors = (
        cell_vectors((into, across), (shown(m - 3), shown(m - 1), shown(m + 1)), everything, pad),
        cell_vectors((across, out), (shown(m - 1), shown(m + 1), shown(m + 3)), everything, pad),
    )
    return HeldOut(shown(m - 1), shown(m), shown(m + 1), vectors)
