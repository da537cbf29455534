"""Choose where to cut a clip so that it loops without a visible seam (Schödl et al., "Video
Textures", SIGGRAPH 2000, section 3)."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.timeline import Timeline
from fire_atlas.timeline.edit_list import Transition, stretch
from fire_atlas.timeline.holds import Holds
from fire_atlas.vision.flat_art import is_flat_art
from fire_atlas.vision.thumbnails import Thumbnails, distance

_OVERLAP = 1 / 3
"""Default duration of a transition, s."""

_MIN_CLIP_PER_OVERLAP = 5
"""By default the clip is at least this many times as long as a transition."""

_INCOHERENT = 1.2
"""Where the median distance of two frames is at most this many median steps, neighbours have little
in common, and a hard cut is no more visible than any step."""

_MAX_FRAMES = 1024
"""Maximum number of frames, from the first on, that are searched for cuts."""

_KERNEL = (1, 4, 6, 4, 1)
"""Weights of neighbouring frames in a distance, so that motion counts, not only one pose."""

_TRIED = 24
"""Number of cuts, the cheapest ones, that are examined closely."""

_SHORTNESS_COST = 4.0
"""Extra cost of a loop, in median steps: this at length 0, falling to 0 at the maximum length."""

_SHORT_LOOP = 12
"""A loop of fewer frames than this keeps at least half of its clip: in a short clip, the best seam
alone would leave a few frames and lose most of the fire."""

_UNSEEN_STEP = 1.1
"""A step of at most this many median steps is not noticed."""

_UNSEEN_FLOW = 0.8
"""Flow at the seam is not noticed up to this fraction of the 95th percentile of the loop's flow."""

_UNSEEN_DETAIL = 0.97
"""Loss of detail is not noticed if a seam has at least this fraction of the loop's median."""


@dataclass(frozen=True, slots=True)
class CutAnalysis:
    """Distances between a clip's frames, and the kind of cut to look for.

    Attributes:
        thumbnails: Small copies of the frames that may be used, and their distances.
        overlap: Frames of each transition; 0 for hard cuts.
        closed: Whether the clip is a loop already, so that frame numbers wrap around.
        holds: Which of these frames show the same drawing. No cut tears them apart.
    """

    thumbnails: Thumbnails
    overlap: int
    closed: bool
    holds: Holds

    @property
    def count(self) -> int:
        """Number of frames that may be used."""
        return len(self.thumbnails.frames)

    def hard_step(self, transition: Transition) -> float:
        """Step of a transition without overlap, in median steps."""
        return self._steps((transition.ending - 1) % self.count, transition.beginning)

    def step_after(self, transition: Transition) -> float:
        """Step from the last frame of a transition to the next, in median steps."""
        first = (transition.beginning + self.overlap) % self.count
        return self._steps(first - 1, first)

    def _steps(self, one: int, other: int) -> float:
        """Distance of two frames, in median steps."""
        return float(self.thumbnails.distances[one, other]) / max(self.thumbnails.median_step, 1e-9)

    @property
    def longest(self) -> int:
        """Number of frames of the longest loop with one transition."""
        return self.count if self.closed else self.count - max(self.overlap, 1)

    @property
    def shortest(self) -> int:
        """Number of frames of the shortest loop that is cut if the recipe states no length."""
        half = -(-self.count // 2)
        return max(self.longest // 2, min(half, _SHORT_LOOP), self.overlap + 1)

    def costs(self) -> NDArray[np.float64]:
        """Dissimilarity of both sides of every transition: entry (ending, beginning), median steps.

        It is the distance in the middle of the overlap, averaged over two neighbours on each side
        (section 3.1, "preserving dynamics"). Transitions that need frames beyond the clip cost inf,
        and so do those that show only a part of a hold before the overlap or after it.
        """
        distances = self.thumbnails.distances.astype(np.float64)
        distances /= max(self.thumbnails.median_step, 1e-9)
        middle, radius = self.overlap // 2, len(_KERNEL) // 2
        filtered = np.zeros_like(distances)
        for k, weight in enumerate(_KERNEL):
            filtered += weight * _shifted(distances, k - radius, self.closed)
        costs = _shifted(filtered / sum(_KERNEL), middle, self.closed)
        if not self.closed:
            costs[self.longest + 1 :] = np.inf
            costs[:, self.longest + 1 :] = np.inf
        starts = self.holds.starts
        costs[~starts] = np.inf
        costs[:, ~np.roll(starts, -self.overlap)] = np.inf
        return costs


def _shifted(distances: NDArray[np.float64], by: int, wraps: bool) -> NDArray[np.float64]:
    """Shift a matrix of distances in time: entry (i, j) becomes that of (i + by, j + by)."""
    at = np.arange(len(distances)) + by
    at = at % len(distances) if wraps else np.clip(at, 0, len(distances) - 1)
    return distances[np.ix_(at, at)]


def analyse_cuts(
    clip: Clip, timeline: Timeline, wanted: int | None, closed: bool, workers: Workers
) -> CutAnalysis:
    """Compare all frames of ``clip``, for a result of ``wanted`` frames (None: any number).

    ``closed``: whether the clip is a loop already.
    """
    used = min(clip.count, _MAX_FRAMES)
    thumbnails = Thumbnails.of(clip, range(used), workers)
    overlap = overlap_of(clip.count, clip.fps, timeline, wanted)
    is_incoherent = thumbnails.median_distance <= _INCOHERENT * thumbnails.median_step
    if timeline.overlap == "auto" and (is_incoherent or is_flat_art(clip)):
        overlap = 0
    is_closed = closed and used == clip.count
    holds = Holds.between(thumbnails.held(is_closed), is_closed)
    if timeline.overlap == "auto" and overlap:
        overlap = -(-overlap // holds.usual) * holds.usual
    return CutAnalysis(thumbnails, overlap, is_closed, holds)


def overlap_of(count: int, fps: float, timeline: Timeline, wanted: int | None) -> int:
    """Return the number of frames of each transition in a clip of ``count`` frames.

    Raises:
        RecipeError: The recipe states more than the clip allows.
    """
    limit = max(1, min(count, wanted or count) // 2)
    if timeline.overlap == "auto":
        return max(1, min(round(_OVERLAP * fps), limit, count // _MIN_CLIP_PER_OVERLAP))
    if timeline.overlap > limit:
        raise RecipeError(
            f"is {timeline.overlap} frames, but of {min(count, wanted or count)} frames at most "
            f"{limit} can overlap",
            key=("timeline", "overlap"),
        )
    return timeline.overlap


def best_cut(analysis: CutAnalysis, frames: int | None) -> Transition | None:
    """Return the transition that makes the best loop; None if there is no such loop.

    Args:
        analysis: The clip's distances.
        frames: Length of the loop; None for any length from ``analysis.shortest`` on.
    """
    lengths = [frames] if frames else range(analysis.shortest, analysis.longest + 1)
    costs = analysis.costs()
    found = sorted(loop for length in lengths for loop in _loops_of(analysis, costs, length))
    tried = [
        (cost + _visible_flaws(analysis, transition), transition)
        for cost, transition in found[:_TRIED]
    ]
    return min(tried)[1] if tried else None


def _loops_of(
    analysis: CutAnalysis, costs: NDArray[np.float64], length: int
) -> Iterator[tuple[float, Transition]]:
    """Yield every loop of ``length`` frames with one transition, and its cost."""
    count, longest = analysis.count, analysis.longest
    if not analysis.overlap < length <= longest:
        return
    starts = np.arange(count if analysis.closed else longest - length + 1)
    endings = (starts + length) % count if analysis.closed else starts + length
    shortness = _SHORTNESS_COST * (1 - length / longest)
    for ending, start in zip(endings.tolist(), starts.tolist(), strict=True):
        if np.isfinite(costs[ending, start]):
            yield float(costs[ending, start]) + shortness, Transition(ending, start)


def _visible_flaws(analysis: CutAnalysis, transition: Transition) -> float:
    """Return a cost for the visible flaws of a transition.

    Flaws are steps that are too large or unlike the others, a step after the transition that is
    faster than nearly all others of the loop, and lost detail.
    """
    seam = pairwise(_approximate_seam(analysis, transition))
    steps = np.array([distance(a, b) for a, b in seam])
    steps /= max(analysis.thumbnails.median_step, 1e-9)
    large = np.maximum(steps - _UNSEEN_STEP, 0).max()
    unlike = abs(np.log(max(steps[-1], 1e-3)))
    flows = analysis.thumbnails.flows
    first = transition.beginning + analysis.overlap
    shown = stretch(first, transition.ending, analysis.count)
    fast = np.percentile(flows[shown[:-1]], 95) if len(shown) > 1 else np.inf
    into = flows[((first or transition.ending) - 1) % analysis.count]
    too_fast = max(into / max(fast, 1e-9) - _UNSEEN_FLOW, 0)
    details = analysis.thumbnails.details
    usual = float(np.median(details[shown])) if shown else 0.0
    detail = min(_seam_details(analysis, transition), default=usual) / max(usual, 1e-12)
    return float(4 * (large + too_fast + max(_UNSEEN_DETAIL - detail, 0)) + unlike)


def _seam_details(analysis: CutAnalysis, transition: Transition) -> Iterator[float]:
    """Yield the detail of each frame of a seam, interpolated between its two sides."""
    details, overlap = analysis.thumbnails.details, analysis.overlap
    for k in range(overlap):
        weight = (k + 1) / (overlap + 1)
        one, other = (details[(start + k) % analysis.count] for start in transition)
        yield float(one + (other - one) * weight)


def _approximate_seam(analysis: CutAnalysis, transition: Transition) -> Iterator[Pixels]:
    """Yield the frames of a seam, small and blended without warping, and those beside it."""
    frames, overlap, count = analysis.thumbnails.frames, analysis.overlap, analysis.count
    mean = frames.mean(axis=0)
    yield frames[(transition.ending - 1) % count]
    for k in range(overlap):
        angle = np.float32(np.pi / 2 * (k + 1) / (overlap + 1))
        one, other = (frames[(start + k) % count] for start in transition)
        cos, sin = np.cos(angle), np.sin(angle)
        a, b = one - mean, other - mean
        correlation = np.sum(a * b) / max(float(np.sqrt(np.sum(a * a) * np.sum(b * b))), 1e-9)
        yield mean + (cos * a + sin * b) / np.sqrt(1 + 2 * cos * sin * max(correlation, 0))
    yield frames[(transition.beginning + overlap) % count]
