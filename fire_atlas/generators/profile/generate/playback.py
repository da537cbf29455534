"""Choose which frames of the clip are played when (the feature statistics learner, III-B).

Neighbouring slices of the fire share a playback track. A track plays one segment of the clip after
another, forwards. After each cut, new particles show the new segment, while older ones go on with
the old segment until they die. So a cut is never seen all at once: it rises with the gas. Tracks
also control the sway of the whole flame, in which a cut rises in the same way.
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
"""Frame rates that differ by less than this fraction count as equal: no frames are blended."""

_MIN_CORRELATION = 0.3
"""A clip whose neighbouring frames correlate by less than this is a cartoon."""

_HELD_RATE = 0.7
"""A cartoon whose frame rate is below this fraction of the result's holds its frames."""

_TRANSITION = 0.6
"""Fraction of a particle's life over which the sway of the next segment fades in at any height."""

_MEAN_WINDOWS = 6.0
"""Length of a clip divided by the standard deviation of the Gaussian of the running mean."""


@dataclass(frozen=True, slots=True)
class FrameSequence:
    """How the frames of a clip are played as frames of the result.

    Attributes:
        rate: Frames of the clip per frame of the result.
        count: Frames of the clip.
        closed: Whether the clip loops.
        holds: Whether each frame is held until the next, as in a cartoon, whose frames differ too
            much to be blended.
        lifetime: Lifetime of a particle, frames of the result.
        max_length: Maximum length of a segment, frames of the result.
    """

    rate: float
    count: int
    closed: bool
    holds: bool
    lifetime: int
    max_length: int

    @classmethod
    def of(cls, side: Side, fps: float, speed: float, lifetime: float) -> "FrameSequence":
        """Plan how to play ``side`` at ``fps``, ``speed`` times as fast as it was filmed.

        Particles live ``lifetime`` seconds, or less if the clip is too short for it.
        """
        rate = side.fps / fps
        rate = speed * (1.0 if abs(rate - 1.0) < _SAME_RATE else rate)
        count = side.detail.count
        frames = (count - 1) / rate
        holds = side.detail.autocorrelation < _MIN_CORRELATION and rate < _HELD_RATE
        if side.closed:
            return cls(rate, count, True, holds, max(round(lifetime * fps), 2), max(int(frames), 2))
        # Half of the frames beyond a lifetime are played; the others let the start vary.
        lifetime_frames = max(2, min(round(lifetime * fps), int(0.4 * frames)))
        max_length = max((int(frames) - lifetime_frames) // 2, 1)
        return cls(rate, count, False, holds, lifetime_frames, max_length)

    def frames_at(
        self, first: NDArray[np.intp], age: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
        """Return two neighbouring frames of the clip and the weight of the second, ``age`` frames
        after segments started at the frames ``first``. All arrays have the same shape."""
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
    """A part of the clip that a track plays.

    Attributes:
        start: Frame of the result; particles born from then on show this segment.
        first: Frame of the clip shown at ``start``; a clip that loops wraps round.
        mirrored: Whether its frames are mirrored left to right.
        forced: Whether it was chosen to match the wind. Then the wind alone sets the lean, and only
            the quick part of its frames' own sway is kept.
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
    """Return the segments of a track in the order of playing; it repeats after ``period`` frames.

    In still air they start anywhere in the clip; in wind, at frames of the leaning state that the
    wind causes in the plane at ``azimuth``, radians.
    """
    chance = generator(seed, RandomStream.SPLICES, track)
    number = max(2, math.ceil(period / (0.85 * sequence.max_length)))
    length = period / number
    shift = chance.random()
    # Every part of the clip is played once, in random order, before any is repeated.
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
    """Return the frame at ``place`` (0..1) among possible first frames, and if it is mirrored."""
    last = sequence.count - 1
    if not sequence.closed:
        last = max(0, int(last - (sequence.max_length + sequence.lifetime) * sequence.rate))
    if chosen is None:
        # Mirroring makes the repetition of few frames less obvious.
        return int(place * (last + 1)), flip and side.detail.is_symmetric
    frame = chosen.frames[int(place * len(chosen.frames))]
    return min(frame, last), chosen.origin == "mirrored"


@dataclass(frozen=True, slots=True)
class PlanarSway:
    """Sway of the whole flame in one vertical plane.

    The sway at each height is that of the segment played when its gas left the base. A clip shows
    the sway in one plane only, so two planes at a right angle have a track each; the flame then
    sways equally from all sides. These tracks are also used by slices, so that the sway and some
    of the detail come from the same moment of the clip.

    Attributes:
        pose: Pose curves of the clip.
        mean: (NODES,) offset of the flame's middle, averaged over the clip.
        running_mean: (frames, NODES) the same, averaged over the time around each frame.
        sequence: How the clip is played.
        segments: The playback track.
        rise_frames: (NODES,) frames that gas takes from the base to each node.
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
        """Plan the sway in plane ``number``: 0 is that of the front, 1 is at a right angle to it.

        Args:
            profile: Source of the pose curves.
            number: Number of the plane and of its playback track.
            sequence: How the clip for that plane is played.
            rise_time, lifetime: Time a particle takes to the top, in seconds and in frames.
            period: See the class.
            wind: Response of the fire to the wind.
            seed: Seed of the recipe.
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
        """Return, for a ``time`` in frames, (NODES,) offsets of the middle from its mean and
        (NODES,) logarithms of the width ratio."""
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
        """Return four arrays (n,): index of a segment, of a node that shows it, its weight and age.

        Most nodes show one segment; those in a transition show two.
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
