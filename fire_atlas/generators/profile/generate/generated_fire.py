"""A generated fire in space and time, independent of any camera."""

import math
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from fire_atlas.core.pixels import REC709, Plane, as_plane
from fire_atlas.generators.profile.generate.particles import (
    DRAWN_UP_TO,
    Particles,
    PeripheralCurve,
    rise_time,
)
from fire_atlas.generators.profile.generate.playback import (
    MEAN_WINDOWS,
    ChangingPlayback,
    ClipMoment,
    FrameSequence,
    Playback,
    Reference,
    bends,
    play,
    transition_frames,
)
from fire_atlas.generators.profile.generate.state_machine import SelectedStates
from fire_atlas.generators.profile.generate.wind_response import WindResponse
from fire_atlas.generators.profile.model import (
    SCORE_UNIT,
    DetailModel,
    Profile,
    Side,
    decoded_shades,
)
from fire_atlas.generators.settings import GenerationSettings

_TRACK_WIDTH = 1.5
"""Width within which slices show the same moment, in correlation lengths of the detail."""

_MAX_TRACKS = 4
"""Maximum number of moments that are seen side by side."""

_LARGEST_LAG = 0.25
"""Lag of the last slices behind the first, seconds."""


@dataclass(frozen=True, slots=True)
class ProfileFireSettings:
    """Settings of a fire that is generated from a profile.

    Attributes:
        generation: Settings that all fire generators share.
        slices: Number of vertical slices round the axis.
        particles: Number of particles alive in each slice.
        detail: Share of the clip's own detail in the picture, 0..1; the rest is particles.
    """

    generation: GenerationSettings
    slices: int
    particles: int
    detail: float


@dataclass(frozen=True, slots=True)
class PlaneOfFire:
    """What a fire shows in one vertical plane: that of the front, or that at a right angle to it.

    A clip shows a fire in one plane only. The plane at a right angle shows a second clip, or other
    moments of the first.

    Attributes:
        side: The clip.
        states: The leaning sets that are selected.
        playback: What is played of the clip.
        mean: (NODES,) offset of the flame's middle, averaged over the clip, flame heights.
        offset: (frames of the clip, NODES) offset of the flame's middle from ``mean``.
        running_mean: (frames of the clip, NODES) the same, averaged over the time around a frame.
        sway_gain: (frames,) factor of the sway: a sustained force settles it.
        base: (x, y) px of the clip at which the axis of the flame meets the ground.
    """

    side: Side
    states: SelectedStates
    playback: Playback
    mean: NDArray[np.float64]
    offset: NDArray[np.float64]
    running_mean: NDArray[np.float64]
    sway_gain: NDArray[np.float64]
    base: tuple[float, float]

    @classmethod
    def of(
        cls, side: Side, wind: WindResponse, generation: GenerationSettings, number: int
    ) -> "PlaneOfFire":
        """Decide what is shown in plane ``number``: 0 is that of the front."""
        frames, fps, loop, seed = (
            generation.frames, generation.fps, generation.loop, generation.seed,
        )  # fmt: skip
        sequence = FrameSequence.of(side, fps)
        transition = transition_frames(frames, fps)
        reference = Reference.random(sequence, frames, loop, transition, seed, number)
        states = SelectedStates.of(side, wind, number * math.pi / 2, reference, fps)
        gain = np.array([wind.sway_gain(i) for i in range(frames)])
        runs = play(side, sequence, reference, states.sets, seed, number)
        still = Playback(sequence, runs, frames, loop, transition, np.zeros(frames))
        shown, own = still.leans(side, gain)
        bend = bends(side, states.sets, shown, own, states.wind_lean, states.force, fps, loop)
        mean = side.pose.offset.mean(axis=0)
        offset = side.pose.offset - mean
        mode = "wrap" if side.closed else "reflect"
        return cls(
            side,
            states,
            replace(still, bend=bend),
            mean,
            offset,
            gaussian_filter1d(offset, len(offset) / MEAN_WINDOWS, axis=0, mode=mode),
            gain,
            side.base,
        )

    def changing(self, after: "PlaneOfFire", share: float) -> "PlaneOfFire":
        """Return what is shown when the wind has changed by a ``share`` (0..1) to that in which
        ``after`` is shown."""
        gain = self.sway_gain + (after.sway_gain - self.sway_gain) * share
        playback = ChangingPlayback.between(self.playback, after.playback, share)
        return replace(self, playback=playback, sway_gain=gain)

    def sway(self, time: float) -> NDArray[np.float64]:
        """Return three curves (3, NODES) at a ``time`` in frames: offset of the middle from its
        mean, that mean, which may be mirrored and is 0 in wind, and the logarithm of the width
        ratio."""
        at = int(time) % len(self.sway_gain)
        gain, calm = float(self.sway_gain[at]), 1 - float(self.states.force[at])
        offset, middle, width = curves = np.zeros((3, len(self.mean)))
        for moment in self.playback.moments(time):
            sign = -1.0 if moment.mirrored else 1.0
            for frame, share in frames_of(moment):
                mean = self.running_mean[frame]
                offset += sign * share * (mean + gain * (self.offset[frame] - mean))
                middle += sign * share * calm * self.mean
                width += share * np.log(self.side.pose.width_ratio[frame])
        return curves


def frames_of(moment: ClipMoment) -> list[tuple[int, float]]:
    """Return the frames of the clip that a moment shows, with their weights."""
    lower = (moment.lower, moment.weight * (1 - moment.share))
    if moment.share == 0:
        return [lower]
    return [lower, (moment.upper, moment.weight * moment.share)]


@dataclass(frozen=True, slots=True)
class GeneratedFire:
    """A generated fire in space and time; its cameras share it.

    Attributes:
        profile: The profile it is generated from.
        settings: Length, frame rate, wind and seed.
        detail: Share of the clip's own detail in the picture, 0..1.
        base_curve: Outline of its base seen from above, half widths of the front.
        slice_azimuths: (slices,) directions of the slices, radians, within ±π/2 of the front.
        slice_planes: (slices,) index of the plane whose moments each slice shows.
        slice_tracks: (slices,) index of the lag of each slice.
        lags: (tracks,) frames by which slices show what is played later than others.
        particles: All particles.
        planes: The plane of the front, and that at a right angle to it.
        flickers: By plane, (frames of the clip,) the score that all cells of a frame share.
        autocorrelations: By plane, (n, rows, columns) correlation 1, 2, 4, 8, ... frames apart of
            what is left of the scores.
        frame_times: (frames,) time of each frame, in frames of the fire's own time.
    """

    profile: Profile
    settings: GenerationSettings
    detail: float
    base_curve: PeripheralCurve
    slice_azimuths: NDArray[np.float64]
    slice_planes: NDArray[np.intp]
    slice_tracks: NDArray[np.intp]
    lags: NDArray[np.float64]
    particles: Particles
    planes: tuple[PlaneOfFire, PlaneOfFire]
    flickers: tuple[NDArray[np.float32], ...]
    autocorrelations: tuple[NDArray[np.float32], ...]
    frame_times: NDArray[np.float64]

    @property
    def period(self) -> int:
        """Number of frames after which the fire repeats."""
        return self.particles.period

    def time_rate(self, frame: int) -> float:
        """Return the speed of the fire's own time after a frame; 1 on average."""
        if self.settings.frames < 2:
            return 1.0
        at = frame if self.settings.loop else min(frame, self.settings.frames - 2)
        following = self.frame_times[(at + 1) % self.settings.frames]
        return float((following - self.frame_times[at]) % self.period)

    def changing(self, after: "GeneratedFire", share: float, time: float) -> "GeneratedFire":
        """Return one frame of a fire whose wind has changed by a ``share`` (0..1) to that of
        ``after``, at a ``time`` in frames of the fire's own time."""
        front, across = (
            plane.changing(other, share)
            for plane, other in zip(self.planes, after.planes, strict=True)
        )
        return replace(self, planes=(front, across), frame_times=np.array([time]))

    @classmethod
    def of(cls, profile: Profile, settings: ProfileFireSettings) -> "GeneratedFire":
        """Generate a fire whose frames are not timed yet."""
        grid, sides, shared = profile.grid, profile.sides, settings.generation
        wind = WindResponse.of(shared.wind, shared.frames, shared.fps, shared.loop)
        base_curve = PeripheralCurve(1.0, sides[-1].half_width / sides[0].half_width)
        azimuths = math.pi * ((np.arange(settings.slices) + 0.5) / settings.slices - 0.5)
        slice_planes = (np.abs(azimuths) > math.pi / 4).astype(np.intp) * (len(sides) - 1)
        rise = rise_time(grid.rows_above / grid.cells_per_height, profile.rise_speed)
        lifetime = max(round(rise * shared.fps), 2)
        # A fire that plays once has fully risen before frame 0, and its end need not fit its start.
        period = shared.frames if shared.loop else shared.frames + lifetime
        particles = Particles.random(
            shared.seed,
            azimuths,
            settings.particles,
            rise_time(DRAWN_UP_TO, profile.rise_speed) * shared.fps,
            lifetime,
            period,
            base_curve,
        )
        tracks = _slice_tracks(profile, settings.slices)
        number = int(tracks.max()) + 1
        lags = np.arange(number) * _LARGEST_LAG * shared.fps / max(number - 1, 1)
        planes = (
            PlaneOfFire.of(sides[0], wind, shared, 0),
            PlaneOfFire.of(sides[-1], wind, shared, 1),
        )
        flickers = [_shared_scores(side.detail) for side in sides]
        correlations = [
            _autocorrelation_maps(side.detail, flicker)
            for side, flicker in zip(sides, flickers, strict=True)
        ]
        return cls(
            profile, shared, settings.detail, base_curve, azimuths, slice_planes, tracks,
            lags.round(), particles, planes,
            (flickers[0], flickers[-1]), (correlations[0], correlations[-1]),
            np.arange(shared.frames, dtype=np.float64),
        )  # fmt: skip


def _slice_tracks(profile: Profile, slices: int) -> NDArray[np.intp]:
    """Return the lag's index of each slice. Wider fires have more."""
    width = _TRACK_WIDTH * max(profile.front.detail.correlation_length, 1.0)
    across = 2.4 * profile.grid.cells_per_half / width
    number = min(max(round(across), 2), _MAX_TRACKS, slices)
    return np.arange(slices) * number // slices


@cache
def scores_of_bytes() -> NDArray[np.float32]:
    """Return the normal score (256,) for which each byte of ``DetailModel.scores`` stands."""
    return (np.arange(256, dtype=np.float32) - 128) / np.float32(SCORE_UNIT)


def scores_of(detail: DetailModel, frame: int) -> Plane:
    """Return the normal scores (rows, columns) of a frame of the clip."""
    return as_plane(cv2.LUT(detail.scores[frame], scores_of_bytes()))


def _shared_scores(detail: DetailModel) -> NDArray[np.float32]:
    """Return what the scores of all cells of each frame share (frames,): the flicker of the whole
    flame. Cells weigh by how much their light changes."""
    light = decoded_shades(detail.shades)[..., :3] @ REC709
    weight = as_plane(light[-1] - light[0])
    total = max(float(weight.sum()), 1e-6)
    shared = [float((scores_of(detail, i) * weight).sum()) / total for i in range(detail.count)]
    return np.array(shared, np.float32)


def _autocorrelation_maps(detail: DetailModel, shared: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the correlation (n, rows, columns), 0..1, of each cell's scores 1, 2, 4, 8, ... frames
    apart, up to the length of the clip, without what all cells of a frame ``shared`` (frames,)."""
    product, power = np.zeros((2, *detail.scores.shape[1:]), np.float32)
    before = scores_of(detail, 0) - shared[0]
    for i in range(1, detail.count):
        after = scores_of(detail, i) - shared[i]
        product += before * after
        power += after * after
        before = after
    correlation = product / np.maximum(power, np.float32(1e-6))
    maps = [as_plane(np.clip(cv2.GaussianBlur(correlation, (0, 0), 2.0), 0, 1))]
    while 1 << len(maps) < detail.count:
        maps.append(np.square(maps[-1]))
    return np.stack(maps)
