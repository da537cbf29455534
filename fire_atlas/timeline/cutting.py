"""Where to cut a clip so that its end passes into its beginning unseen (Schödl et al., "Video
Textures", SIGGRAPH 2000, section 3)."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels
from fire_atlas.timeline.takes import Join, stretch
from fire_atlas.vision.thumbnails import Thumbnails, distance

_SMOOTHING = (1, 4, 6, 4, 1)
"""Weights of a frame's neighbours: what moves the other way is not alike."""

_TRIED = 24
"""Best cuts that are tried out."""

_SHORTNESS = 2.0
"""What a loop of no length would cost, against one as long as the clip."""

_SHORT = 12
"""A loop of fewer frames than this keeps at least half of its clip: of a short clip, the best seam
alone would keep a few frames and lose most of the fire."""

_STEP = 1.1
"""A step this many times the median is not seen."""

_HASTE = 0.8
"""Flow at the seam this near to the 95th percentile of the loop's is not seen."""

_DETAIL = 0.97
"""Detail in a seam this near to the median of the loop's is not missed."""


@dataclass(frozen=True, slots=True)
class Footage:
    """What is known of a clip that is to be cut.

    Attributes:
        thumbnails: Of all its frames that may be used.
        overlap: Frames of each join.
        closed: Whether the first frame follows the last already.
    """

    thumbnails: Thumbnails
    overlap: int
    closed: bool

    @property
    def count(self) -> int:
        """Frames that may be used."""
        return len(self.thumbnails.frames)

    def jump(self, join: Join) -> float:
        """Step of a join that is cut hard, in median steps."""
        apart = self.thumbnails.apart[(join.ending - 1) % self.count, join.beginning]
        return float(apart) / max(self.thumbnails.step, 1e-9)

    def step_into(self, join: Join) -> float:
        """Step with which the take after a join begins, in median steps."""
        begun = (join.beginning + self.overlap) % self.count
        return float(self.thumbnails.apart[begun - 1, begun]) / max(self.thumbnails.step, 1e-9)

    @property
    def longest(self) -> int:
        """Frames of the longest loop with one join."""
        return self.count if self.closed else self.count - max(self.overlap, 1)

    @property
    def shortest(self) -> int:
        """Frames of the shortest loop that is cut where no length is asked for."""
        half = -(-self.count // 2)
        return max(self.longest // 2, min(half, _SHORT), self.overlap + 1)

    def costs(self) -> NDArray[np.float64]:
        """How unlike both sides of every join are, in median steps: entry (ending, beginning).

        The distance in the middle of the overlap, smoothed over two neighbours either way. Joins
        that would need frames the clip does not have cost infinitely much.
        """
        apart = self.thumbnails.apart.astype(np.float64) / max(self.thumbnails.step, 1e-9)
        middle, reach = self.overlap // 2, len(_SMOOTHING) // 2
        smooth = np.zeros_like(apart)
        for k, weight in enumerate(_SMOOTHING):
            smooth += weight * _moved(apart, k - reach, self.closed)
        costs = _moved(smooth / sum(_SMOOTHING), middle, self.closed)
        if not self.closed:
            costs[self.longest + 1 :] = np.inf
            costs[:, self.longest + 1 :] = np.inf
        return costs


def _moved(apart: NDArray[np.float64], by: int, goes_round: bool) -> NDArray[np.float64]:
    """Distances ``by`` frames later in both: entry (i, j) is that of (i + by, j + by)."""
    at = np.arange(len(apart)) + by
    at = at % len(apart) if goes_round else np.clip(at, 0, len(apart) - 1)
    return apart[np.ix_(at, at)]


def best_cut(footage: Footage, frames: int | None) -> Join | None:
    """Return the join that makes the best loop; None if there is no such loop.

    Args:
        footage: The clip.
        frames: Length of the loop. None: any from the shortest that keeps enough of the clip.
    """
    costs, overlap, count = footage.costs(), footage.overlap, footage.count
    longest = footage.longest
    lengths = [frames] if frames else range(footage.shortest, longest + 1)
    found: list[tuple[float, Join]] = []
    for length in lengths:
        if not overlap < length <= longest:
            continue
        starts = np.arange(count if footage.closed else longest - length + 1)
        endings = (starts + length) % count if footage.closed else starts + length
        short = _SHORTNESS * (1 - length / longest)
        found += [
            (float(costs[ending, start]) + short, Join(int(ending), int(start)))
            for ending, start in zip(endings, starts, strict=True)
            if np.isfinite(costs[ending, start])
        ]
    found.sort()
    tried = [(cost + _flaws(footage, join), join) for cost, join in found[:_TRIED]]
    return min(tried)[1] if tried else None


def _flaws(footage: Footage, join: Join) -> float:
    """What would be seen of a join: steps that are too large or unlike the others, or a first step
    that is faster than nearly all others of the loop."""
    steps = np.array([distance(a, b) for a, b in pairwise(_around(footage, join))])
    steps /= max(footage.thumbnails.step, 1e-9)
    large = np.maximum(steps - _STEP, 0).max()
    unlike = abs(np.log(max(steps[-1], 1e-3)))
    flows = footage.thumbnails.flows
    begun = join.beginning + footage.overlap
    shown = stretch(begun, join.ending, footage.count)
    fast = np.percentile(flows[shown[:-1]], 95) if len(shown) > 1 else np.inf
    into = flows[((begun or join.ending) - 1) % footage.count]
    hasty = max(into / max(fast, 1e-9) - _HASTE, 0)
    details = footage.thumbnails.details
    usual = float(np.median(details[shown])) if shown else 0.0
    faint = min(_details(footage, join), default=usual) / max(usual, 1e-12)
    return float(4 * (large + hasty + max(_DETAIL - faint, 0)) + unlike)


def _details(footage: Footage, join: Join) -> Iterator[float]:
    """Detail of the frames of a seam: as much as their two sides have."""
    details, count, overlap = footage.thumbnails.details, footage.count, footage.overlap
    for k in range(overlap):
        part = (k + 1) / (overlap + 1)
        one, other = details[(join.ending + k) % count], details[(join.beginning + k) % count]
        yield float(one + (other - one) * part)


def _around(footage: Footage, join: Join) -> Iterator[Pixels]:
    """Small copies of the frames of a seam as it would be, with the ones before and after it."""
    frames, overlap = footage.thumbnails.frames, footage.overlap
    count = len(frames)
    mean = frames.mean(axis=0)
    yield frames[(join.ending - 1) % count]
    for k in range(overlap):
        angle = np.float32(np.pi / 2 * (k + 1) / (overlap + 1))
        one, other = frames[(join.ending + k) % count], frames[(join.beginning + k) % count]
        cos, sin = np.cos(angle), np.sin(angle)
        a, b = one - mean, other - mean
        alike = np.sum(a * b) / max(float(np.sqrt(np.sum(a * a) * np.sum(b * b))), 1e-9)
        yield mean + (cos * a + sin * b) / np.sqrt(1 + 2 * cos * sin * max(alike, 0))
    yield frames[(join.beginning + overlap) % count]
