"""Choose which frames of the clip are played when (the feature statistics learner, III-B).

Neighbouring slices of the fire share a playback track. A track plays a segment of the clip
forwards, then another, and so on. Particles born after such a cut show the new segment, those born
before rise and die with the old one. So a cut is never seen at once: it rises with the gases. The
sway of the whole flame goes by tracks too, and there as well a cut rises through the flame.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.profile.generate.particles import height_after
from fire_atlas.generators.profile.generate.wind import WindResponse
from fire_atlas.generators.profile.model import (
    LeaningSet,
    PoseCurves,
    Profile,
    Side,
    leaning_state,
    node_heights,
)

_SAME_RATE = 0.1
"""Rates that differ by less are taken for the same: frames then need not be blended."""

_MIN_CORRELATION = 0.3
"""Frames whose neighbours correlate by less than this are those of a cartoon."""

_HELD_RATE = 0.7
"""A cartoon that plays slower than this, of the result's rate, holds its frames."""

_TRANSITION = 0.6
"""Part of a particle's life in which, at any height, one segment's sway fades into the next's."""

_MEAN_WINDOWS = 6.0
"""A clip's length divided by this is the standard deviation of the running mean, in frames."""


@dataclass(frozen=True, slots=True)
class FrameSequence:
    """How the frames of a clip are played as frames of the result.

    Attributes:
        rate: Frames of the clip per frame of the result.
        count: Frames of the clip.
        closed: Whether its first follows its last.
        holds: Whether a frame is held until the next: those of a cartoon have so little in common
            that a blend of two is neither.
        lifetime: Frames of the result for which a particle lives.
        max_length: Frames of the result that a segment may last.
    """

    rate: float
    count: int
    closed: bool
    holds: bool
    lifetime: int
    max_length: int

    @classmethod
    def of(cls, side: Side, fps: float, speed: float, lifetime: float) -> "FrameSequence":
        """Plan how ``side`` is played at ``fps``, ``speed`` times as fast as it was filmed.

        Particles live ``lifetime`` seconds, or less if the clip is too short for it.
        """
        rate = side.fps / fps
        rate = speed * (1.0 if abs(rate - 1.0) < _SAME_RATE else rate)
        count = side.detail.count
        frames = (count - 1) / rate
        holds = side.detail.autocorrelation < _MIN_CORRELATION and rate < _HELD_RATE
        if side.closed:
            return cls(rate, count, True, holds, max(round(lifetime * fps), 2), max(int(frames), 2))
        # Of a clip that does not close, half of what a life leaves is played, from anywhere in it.
        lives = max(2, min(round(lifetime * fps), int(0.4 * frames)))
        max_length = max((int(frames) - lives) // 2, 1)
        return cls(rate, count, False, holds, lives, max_length)

    def frames_at(
        self, first: NDArray[np.intp], age: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
        """Return two neighbouring frames of the clip and the weight of the second, ``age`` frames
        after segments began with the frames ``first``; all of one shape."""
        at = first + age * self.rate
        if self.holds:
            at = np.floor(at)
        begun = np.floor(at)
        lower, share = begun.astype(np.intp), at - begun
        if self.closed:
            return lower % self.count, (lower + 1) % self.count, share
        lower = np.clip(lower, 0, self.count - 1)
        return lower, np.minimum(lower + 1, self.count - 1), share


@dataclass(frozen=True, slots=True)
class ClipSegment:
    """A part of the clip that is played from some frame of the result on.

    Attributes:
        start: Frame from which on what is born shows it.
        first: Frame of the clip shown at ``start``; clips that close go round.
        mirrored: Whether left and right are exchanged.
        forced: Whether it was chosen for a wind, which alone then decides how the fire leans: of
            its frames' own lean only the quick sway is kept.
    """

    start: int
    first: int
    mirrored: bool
    forced: bool


def playback_track(
    side: Side,
    sequence: FrameSequence,
    period: int,
    wind: WindResponse,
    azimuth: float,
    seed: int,
    track: int,
) -> tuple[ClipSegment, ...]:
    """Return the segments of a track through ``period`` frames, in order; then the first follows.

    In still air they begin anywhere in the clip; in wind, among the frames of the leaning state it
    causes at that ``azimuth``, radians.
    """
    chance = generator(seed, RandomStream.SPLICES, track)
    number = max(2, math.ceil(period / (0.85 * sequence.max_length)))
    length = period / number
    shift = chance.random()
    # Each part of the clip comes once before any comes again, in a shuffled order.
    phase = chance.random()
    order = chance.permutation(number)
    jitter = chance.uniform(-0.07, 0.07, number) * length
    flips = chance.random(number) < 0.5
    segments = []
    for i in range(number):
        start = int((i + shift) * length + jitter[i]) % period
        state = wind.leaning_state(start if start < len(wind.steadiness) else 0, azimuth)
        chosen = None if state is None else _leaning_set(side, *state)
        place = (float(order[i]) + phase) / number
        first, mirrored = _first_frame(side, sequence, chosen, place, bool(flips[i]))
        segments.append(ClipSegment(start, first, mirrored, chosen is not None))
    return tuple(sorted(segments, key=lambda segment: segment.start))


def _leaning_set(side: Side, lean: float, period: str) -> LeaningSet:
    state = leaning_state(side.statistics.lean.median + lean)
    return [each for each in side.sets if each.period == period][state]


def _first_frame(
    side: Side, sequence: FrameSequence, chosen: LeaningSet | None, place: float, flip: bool
) -> tuple[int, bool]:
    """Return the frame at ``place`` (0..1) among those to begin with, and whether to mirror it."""
    last = sequence.count - 1
    if not sequence.closed:
        last = max(0, int(last - (sequence.max_length + sequence.lifetime) * sequence.rate))
    if chosen is None:
        # Of few frames repetition shows; mirrored they are others.
        return int(place * (last + 1)), flip and side.detail.is_symmetric
    frame = chosen.frames[int(place * len(chosen.frames))]
    return min(frame, last), chosen.origin == "mirrored"


@dataclass(frozen=True, slots=True)
class PlanarSway:
    """Sway of the whole flame in one vertical plane.

    Each height sways by the segment that was played when its gases left the base. The clip shows
    how a flame sways in one plane; in two planes at a right angle it does so by tracks of their
    own, so that it sways alike as seen from anywhere. These are tracks of slices too, so that sway
    and some of the detail are of one moment of the clip.

    Attributes:
        pose: Pose curves of the clip.
        mean: (NODES,) offset of the flame's middle, averaged over the clip.
        running_mean: (frames, NODES) averaged over a while before and after each frame.
        sequence: How its clip is played.
        segments: The playback track.
        rise_frames: (NODES,) frames after which what was born at the base is at each node.
        period: Frames after which the fire repeats.
    """

    pose: PoseCurves
    mean: NDArray[np.float64]
    running_mean: NDArray[np.float64]
    sequence: FrameSequence
    segments: tuple[ClipSegment, ...]
    rise_frames: NDArray[np.float64]
    period: int

    @classmethod
    def of(
        cls, profile: Profile, number: int, sequence: FrameSequence, rise_time: float,
        lifetime: int, period: int, wind: WindResponse, seed: int,
    ) -> "PlanarSway":  # fmt: skip
        """Plan the sway in plane ``number``: 0 that of the front, 1 at a right angle to it.

        Args:
            profile: What was learnt.
            number: Of the plane, and of its playback track.
            sequence: How the clip of that side is played.
            rise_time, lifetime: Seconds, and frames, in which a particle reaches the top.
            period: As of the class.
            wind: How the fire responds to it.
            seed: Of the recipe.
        """
        side = profile.sides[-number]
        offset, share = side.pose.offset, np.linspace(0.0, 1.0, 256)
        heights = height_after(share * rise_time, profile.rise_speed)
        return cls(
            side.pose,
            offset.mean(axis=0),
            gaussian_filter1d(
                offset, len(offset) / _MEAN_WINDOWS, axis=0,
                mode="wrap" if side.closed else "reflect",
            ),
            sequence,
            playback_track(side, sequence, period, wind, number * math.pi / 2, seed, number),
            np.interp(node_heights(), heights, share * lifetime),
            period,
        )  # fmt: skip

    def at(self, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(NODES,) offsets of the middle from its mean, and logarithms of the width ratio, at a
        ``time`` in frames."""
        which, node, weight, age = self._seen(time)
        segments = [self.segments[i] for i in which]
        first = np.array([segment.first for segment in segments])
        lower, upper, share = self.sequence.frames_at(first, age)

        def shown(curves: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(curves[lower, node] * (1 - share) + curves[upper, node] * share)

        def summed(values: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(np.bincount(node, values, len(self.rise_frames)), np.float64)

        forced = [segment.forced for segment in segments]
        moved = shown(self.pose.offset) - np.where(
            forced, shown(self.running_mean), self.mean[node]
        )
        moved = np.where([segment.mirrored for segment in segments], -moved, moved)
        norm = np.sqrt(np.maximum(summed(weight * weight), 1e-30))
        width = np.log(shown(self.pose.width_ratio))
        return summed(weight * moved) / norm, summed(weight * width) / norm

    def _seen(
        self, time: float
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
        """Return which segments are seen at which nodes, (n,) each, with their weight and age.

        At most nodes one segment is seen, at some it fades into the next.
        """
        transition = _TRANSITION * float(self.rise_frames[-1])
        starts = np.array([segment.start for segment in self.segments])
        lengths = (np.append(starts[1:], starts[0]) - starts) % self.period
        lengths[lengths == 0] = self.period
        since = np.mod(time - self.rise_frames - starts[:, None] + transition / 2, self.period)
        weights = smooth_step(since / transition)
        weights *= smooth_step((lengths[:, None] + transition - since) / transition)
        which, node = np.nonzero(weights)
        age = (since[which, node] - transition / 2 + self.rise_frames[node]).round(6)
        return which, node, weights[which, node], age
