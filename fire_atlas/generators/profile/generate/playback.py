"""Play frames of the leaning sets that are selected (the feature statistics learner, III-B).

In still air a *reference* plays the clip: one segment after another, forwards, each part of it
once before any is repeated. Frames are drawn from the selected set: that of the reference if it is
in the set, else the one after the last if that is, else a jump to a frame of the set that the clip
goes on from within the set for long. (The paper goes back and forth in a set. Gas would fall.)
After a jump the new frames fade in and the old ones out.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.easing import smooth_step
from fire_atlas.generators.profile.model import STATE_EDGES, Side

MEAN_WINDOWS = 6.0
"""Length of a clip divided by the standard deviation of the Gaussian of the running mean."""

TRANSITION_TIME = 0.2
"""Time over which frames fade into others after a jump, seconds."""

_SAME_RATE = 0.1
"""Frame rates that differ by less than this fraction count as equal: no frames are blended."""

_MIN_CORRELATION = 0.3
"""A clip whose neighbouring frames correlate by less than this is a cartoon."""

_HELD_RATE = 0.7
"""A cartoon whose frame rate is below this fraction of the result's holds its frames."""

_LONG_AHEAD = 12
"""Frames ahead within a set beyond which a longer way is no better."""

_BEND_TIME = 0.12
"""Standard deviation, seconds, of the smoothing of the bend from one set to the next."""


@dataclass(frozen=True, slots=True)
class FrameSequence:
    """How the frames of a clip are played as frames of the result.

    Attributes:
        rate: Frames of the clip per frame of the result.
        count: Frames of the clip.
        closed: Whether the clip loops.
        holds: Whether each frame is held until the next, as in a cartoon, whose frames differ too
            much to be blended.
    """

    rate: float
    count: int
    closed: bool
    holds: bool

    @classmethod
    def of(cls, side: Side, fps: float) -> "FrameSequence":
        """Plan how to play ``side`` at ``fps``, as fast as it was filmed."""
        rate = side.fps / fps
        rate = 1.0 if abs(rate - 1.0) < _SAME_RATE else rate
        holds = side.detail.autocorrelation < _MIN_CORRELATION and rate < _HELD_RATE
        return cls(rate, side.detail.count, side.closed, holds)

    def after(self, position: float, ticks: float) -> float:
        """Return the position in the clip ``ticks`` frames of the result after another one; a clip
        that does not loop stops at its last frame."""
        at = position + ticks * self.rate
        return at % self.count if self.closed else min(at, self.count - 1.0)

    def frames_at(self, position: float) -> tuple[int, int, float]:
        """Return two neighbouring frames at a position, and the weight of the second."""
        # Sums of rates are rounded, or the frame before an exact one would be taken.
        at = round(math.floor(position + 1e-6) if self.holds else position, 6)
        lower = int(at)
        if self.closed:
            return lower % self.count, (lower + 1) % self.count, at - lower
        return lower, min(lower + 1, self.count - 1), at - lower


@dataclass(frozen=True, slots=True)
class Reference:
    """How a clip is played in still air.

    Attributes:
        positions: (frames,) position in the clip, in its frames.
        cuts: (frames,) whether a segment begins.
        loop: Whether the last frame is followed by the first.
    """

    positions: NDArray[np.float64]
    cuts: NDArray[np.bool_]
    loop: bool

    @classmethod
    def random(
        cls,
        sequence: FrameSequence,
        frames: int,
        loop: bool,
        transition: int,
        seed: int,
        plane: int,
    ) -> "Reference":
        """Choose segments at random, so that each part of the clip is played equally often.

        Args:
            sequence: How the clip is played.
            frames: Frames of the result.
            loop: Whether the result loops.
            transition: Frames over which a segment fades into the next.
            seed: Seed of the recipe.
            plane: Number of the vertical plane, which has random numbers of its own.
        """
        chance = generator(seed, RandomStream.SPLICES, plane)
        whole = sequence.count / sequence.rate
        number = max(2, math.ceil(frames / max(0.85 * whole, 1.0)))
        length, shift, phase = frames / number, chance.random(), chance.random()
        order = chance.permutation(number)
        jitter = chance.uniform(-0.07, 0.07, number) * length
        starts = np.array([int((i + shift) * length + jitter[i]) % frames for i in range(number)])
        firsts = ((order + phase) / number * whole * sequence.rate).astype(np.intp)
        ascending = np.argsort(starts, kind="stable")
        starts, firsts = starts[ascending], firsts[ascending]
        if not sequence.closed:
            starts, firsts = _cut_at_the_end(starts, firsts, sequence, frames, transition)
        ticks = np.arange(frames)
        # A loop begins within the last segment.
        segment = np.searchsorted(starts, ticks, side="right") - 1
        ages = (ticks - starts[segment]) % frames
        positions = [
            sequence.after(float(firsts[at]), float(age))
            for at, age in zip(segment, ages, strict=True)
        ]
        cuts = ages == 0
        cuts[0] = True
        return cls(np.array(positions).round(6), cuts, loop)


def _cut_at_the_end(
    starts: NDArray[np.intp],
    firsts: NDArray[np.intp],
    sequence: FrameSequence,
    frames: int,
    shortest: int,
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the segments of a clip that does not loop, each that goes on beyond its end as two:
    the second from its beginning. So its ends are played as often as its middle; the last frame is
    held while it fades out.

    Args:
        starts: (segments,) frame of the result at which each begins, ascending.
        firsts: (segments,) frame of the clip with which each begins.
        sequence: How the clip is played.
        frames: Frames of the result.
        shortest: Length of the shortest segments, frames of the result.
    """
    cut: list[tuple[int, int]] = []
    for start, first, after in zip(starts, firsts, np.roll(starts, -1), strict=True):
        length, room = int(after - start) % frames, int((sequence.count - first) / sequence.rate)
        if room < shortest:
            cut.append((int(start), 0))
        elif length < room + shortest:
            earlier = math.ceil(max(length - room, 0) * sequence.rate)
            cut.append((int(start), max(int(first) - earlier, 0)))
        else:
            cut += [(int(start), int(first)), (int(start + room) % frames, 0)]
    ordered = np.array(sorted(cut), np.intp)
    return ordered[:, 0], ordered[:, 1]


@dataclass(frozen=True, slots=True)
class Run:
    """Frames of the clip that are played one after another.

    Attributes:
        start: Frame of the result at which it begins.
        length: Frames of the result before the next run begins.
        first: Position in the clip at ``start``.
        mirrored: Whether its frames are mirrored left to right.
    """

    start: int
    length: int
    first: float
    mirrored: bool


@dataclass(frozen=True, slots=True)
class ClipMoment:
    """A moment of the clip that is seen in a frame of the result.

    Attributes:
        lower, upper: Two neighbouring frames of the clip.
        share: Weight of the second, 0..1.
        mirrored: Whether they are mirrored left to right.
        weight: Weight among all moments of the frame; they sum to 1.
    """

    lower: int
    upper: int
    share: float
    mirrored: bool
    weight: float


@dataclass(frozen=True, slots=True)
class Playback:
    """What is played of one clip, in one vertical plane of a fire.

    Attributes:
        sequence: How the clip is played.
        runs: The runs, in the order of playing.
        frames: Frames of the result.
        loop: Whether the last is followed by the first.
        transition: Frames over which a run fades into the next.
        bend: (frames,) degrees by which the frames are sheared to the right.
    """

    sequence: FrameSequence
    runs: tuple[Run, ...]
    frames: int
    loop: bool
    transition: int
    bend: NDArray[np.float64]

    def moments(self, time: float) -> list[ClipMoment]:
        """Return the moments of the clip that are seen at ``time``, in frames of the result."""
        time = time % self.frames if self.loop else min(max(time, 0.0), self.frames - 1.0)
        seen = []
        for run in self.runs:
            since = (time - run.start) % self.frames if self.loop else time - run.start
            # In a loop a run may still fade out when it has begun again.
            for age in (since, since + self.frames) if self.loop else (since,):
                until = run.length + self.transition
                if not 0 <= age < until:
                    continue
                shares = np.array([(age + 1), until - age]) / (self.transition + 1)
                weight = float(smooth_step(shares).prod())
                if run.start == 0 and not self.loop:
                    weight = float(smooth_step(shares[1:])[0])
                frames = self.sequence.frames_at(self.sequence.after(run.first, age))
                seen.append(ClipMoment(*frames, run.mirrored, weight))
        total = sum(moment.weight for moment in seen)
        return [
            ClipMoment(m.lower, m.upper, m.share, m.mirrored, m.weight / total)
            for m in seen
            if m.weight > 1e-3 * total
        ]

    def leans(
        self, side: Side, sway_gain: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the lean, degrees, of what is shown of ``side`` in every frame (frames,), its sway
        times ``sway_gain`` (frames,); and the part of it that is the mean lean of the clip."""
        leans = np.array(side.leans)
        mode = "wrap" if side.closed else "reflect"
        mean = gaussian_filter1d(leans, len(leans) / MEAN_WINDOWS, mode=mode)
        shown, own = np.zeros((2, self.frames))
        for tick in range(self.frames):
            swayed = mean + sway_gain[tick] * (leans - mean)
            for moment in self.moments(float(tick)):
                weight = -moment.weight if moment.mirrored else moment.weight
                lower, upper = swayed[moment.lower], swayed[moment.upper]
                shown[tick] += weight * (lower + (upper - lower) * moment.share)
                own[tick] += weight * leans.mean()
        return shown, own

    def bend_at(self, time: float) -> float:
        """Return the shear to the right at ``time``, degrees."""
        at = np.arange(self.frames)
        period = self.frames if self.loop else None
        return float(np.interp(time, at, self.bend, period=period))


@dataclass(frozen=True, slots=True)
class ChangingPlayback(Playback):
    """What is played while the wind changes: moments of the loops in both winds, which fade.

    Attributes:
        after: What is played of the same clip in the new wind.
        share: Weight of ``after``, 0..1.
    """

    after: Playback
    share: float

    @classmethod
    def between(cls, before: Playback, after: Playback, share: float) -> "ChangingPlayback":
        """Return what is played when a ``share`` of the change from ``before`` is over."""
        bend = before.bend + (after.bend - before.bend) * share
        fixed = before.sequence, before.runs, before.frames, before.loop, before.transition
        return cls(*fixed, bend, after, share)

    def moments(self, time: float) -> list[ClipMoment]:
        """See ``Playback.moments``."""
        before, after = Playback.moments(self, time), self.after.moments(time)
        fading = [(moment, 1 - self.share) for moment in before]
        fading += [(moment, self.share) for moment in after]
        return [replace(moment, weight=moment.weight * share) for moment, share in fading]


def frames_in_sets(side: Side) -> NDArray[np.bool_]:
    """Return which frames are in which set: (sets, frames, 2); the last axis is mirroring."""
    found = np.zeros((len(side.sets), side.detail.count, 2), np.bool_)
    for k, leaning_set in enumerate(side.sets):
        found[k, list(leaning_set.frames), int(leaning_set.origin == "mirrored")] = True
    return found


class _Player:
    """Plays a clip frame by frame, from the sets that are selected."""

    def __init__(self, side: Side, sequence: FrameSequence, seed: int, plane: int) -> None:
        self.in_sets, self.sequence = frames_in_sets(side), sequence
        self.seed, self.plane = seed, plane
        self.ahead = np.stack([_ahead(is_member, sequence.closed) for is_member in self.in_sets])
        self.position, self.mirrored, self.follows = -1.0, False, False

    def step(self, tick: int, reference: float, cut: bool, selected: int) -> bool:
        """Go on to frame ``tick`` of the result, and return whether that was a jump."""
        is_member = self.in_sets[selected]
        in_set = bool(is_member[int(reference), 0])
        if in_set and self.follows and not cut:
            self.position = reference
            return False
        after = self.sequence.after(self.position, 1.0)
        ends = not self.sequence.closed and after >= self.sequence.count - 1
        may_go_on = self.position >= 0 and not ends and is_member[int(after), int(self.mirrored)]
        if may_go_on and not (cut and in_set):
            self.position, self.follows = after, False
            return False
        self.follows = in_set
        if in_set:
            self.position, self.mirrored = reference, False
            return True
        ways = np.minimum(self.ahead[selected], _LONG_AHEAD)
        frames, flips = np.nonzero((ways > 0) & (ways >= 0.7 * ways.max()))
        # Keyed by the frame, so that one jump more does not change all that follow.
        chance = generator(self.seed, RandomStream.LEANING_SETS, 2 * tick + self.plane)
        choice = int(chance.integers(len(frames)))
        self.position, self.mirrored = float(frames[choice]), bool(flips[choice])
        return True


def _ahead(is_member: NDArray[np.bool_], closed: bool) -> NDArray[np.intp]:
    """Return for how many frames (frames, 2) the clip stays in a set, from each frame on."""
    count = len(is_member)
    ahead = np.zeros((2 * count + 1, 2), np.intp)
    for i in range(2 * count - 1, -1, -1):
        begins_again = ahead[i + 1] if closed or (i + 1) % count else 0
        ahead[i] = (begins_again + 1) * is_member[i % count]
    return ahead[:count]


def transition_frames(frames: int, fps: float) -> int:
    """Return over how many frames of a result frames of its clip fade into others."""
    return min(max(round(TRANSITION_TIME * fps), 1), max(frames // 2, 1))


def play(
    side: Side,
    sequence: FrameSequence,
    reference: Reference,
    selected: NDArray[np.intp],
    seed: int,
    plane: int,
) -> tuple[Run, ...]:
    """Return the runs that show the ``selected`` sets (frames,)."""
    player = _Player(side, sequence, seed, plane)
    frames = len(selected)
    begun: list[tuple[int, float, bool]] = []
    for tick in range(frames):
        cut, state = bool(reference.cuts[tick]), int(selected[tick])
        if player.step(tick, float(reference.positions[tick]), cut, state):
            begun.append((tick, player.position, player.mirrored))
    ends = [start for start, _, _ in begun[1:]] + [frames]
    return tuple(
        Run(start, end - start, first, mirrored)
        for (start, first, mirrored), end in zip(begun, ends, strict=True)
    )


def bends(
    side: Side,
    selected: NDArray[np.intp],
    shown: NDArray[np.float64],
    own: NDArray[np.float64],
    wind_lean: NDArray[np.float64],
    force: NDArray[np.float64],
    fps: float,
    loop: bool,
) -> NDArray[np.float64]:
    """Return the shear of every frame (frames,), degrees to the right.

    In still air only frames whose own lean is not that of the set are sheared, by the set's shear.
    In wind they are moved to the lean of the force, within the limits of the set's state: the
    larger the force, the larger the lean. Smoothed, so that the fire follows in its own time.

    Args:
        side: The clip.
        selected: (frames,) the leaning set.
        shown: (frames,) lean of the clip's frame, degrees.
        own: (frames,) mean lean of the clip in it, which a force takes out.
        wind_lean, force: As in ``SelectedStates``.
        fps: Frames of the fire per second.
        loop: Whether it loops.
    """
    limits = np.array([(leaning_set.low, leaning_set.high) for leaning_set in side.sets])[selected]
    low, high = limits.T
    outer_low, outer_high = low == STATE_EDGES[0], high == STATE_EDGES[-1]
    is_own = ((shown >= low) | outer_low) & ((shown < high) | outer_high)
    shear = np.array([leaning_set.shear for leaning_set in side.sets])[selected]
    calm = np.where(is_own, 0.0, shear)
    blown = np.clip(wind_lean, low, high) - (shown - own)
    mode = "wrap" if loop else "nearest"
    bend = gaussian_filter1d((1 - force) * calm + force * blown, _BEND_TIME * fps, mode=mode)
    return np.asarray(bend, np.float64)
