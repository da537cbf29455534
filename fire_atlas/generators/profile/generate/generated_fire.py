"""A generated fire in space and time: what all cameras that look at it share."""

import itertools
import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.profile.generate.particles import (
    Particles,
    peripheral_curve,
    rise_time,
)
from fire_atlas.generators.profile.generate.playback import (
    ClipSegment,
    FrameSequence,
    PlanarSway,
    playback_track,
)
from fire_atlas.generators.profile.generate.wind import WindResponse
from fire_atlas.generators.profile.model import SCORE_UNIT, DetailModel, Profile
from fire_atlas.generators.settings import GenerationSettings

_MIN_LIFETIME, _MAX_LIFETIME = 0.4, 1.6
"""Seconds a particle lives."""

_TRACK_WIDTH = 1.5
"""Width of the fire that one playback track fills, in correlation lengths of its detail."""

_MAX_TRACKS = 4
"""More than this many parts of a clip side by side look like several fires."""

Tracks = tuple[tuple[tuple[ClipSegment, ...], ...], ...]
"""Segments by side, playback track and order."""


@dataclass(frozen=True, slots=True)
class ProfileFireSettings:
    """Settings of a fire that is generated from a profile.

    Attributes:
        generation: Settings of any generated fire.
        slices: Vertical slices round the axis.
        particles: Particles alive in each.
    """

    generation: GenerationSettings
    slices: int
    particles: int


@dataclass(frozen=True, slots=True)
class GeneratedFire:
    """A generated fire in space and time.

    Attributes:
        profile: What was learnt of it.
        settings: Its length, frame rate, wind and seed.
        wind: How it responds to the wind.
        base_curve: Outline of its base, half widths of the front.
        slice_azimuths: (slices,) radians, within 90 degrees of the front.
        slice_sides: (slices,) which of the profile's sides each slice shows.
        slice_tracks: (slices,) which playback track each goes by.
        particles: All of them.
        sequences: How each side's clip is played.
        tracks: The playback tracks.
        particle_segments: (particles,) index of the segment, in its track, that each shows.
        sways: In the plane of the front, and at a right angle to it.
        autocorrelations: By side, (rows, columns) correlation of one frame's scores with the next.
        rise_time: Seconds in which a particle reaches the top of the grid.
        frame_times: (frames,) time of each frame, in frames of the fire's own time.
        sway_gain: Factor of the clip's sway.
        lean_bias: Degrees added to the lean, to the right of the front.
    """

    profile: Profile
    settings: GenerationSettings
    wind: WindResponse
    base_curve: CubicSpline
    slice_azimuths: NDArray[np.float64]
    slice_sides: NDArray[np.intp]
    slice_tracks: NDArray[np.intp]
    particles: Particles
    sequences: tuple[FrameSequence, ...]
    tracks: Tracks
    particle_segments: NDArray[np.intp]
    sways: tuple[PlanarSway, PlanarSway]
    autocorrelations: tuple[Plane, ...]
    rise_time: float
    frame_times: NDArray[np.float64]
    sway_gain: float
    lean_bias: float

    @property
    def period(self) -> int:
        """Frames after which the fire repeats."""
        return self.particles.period

    def time_rate(self, frame: int) -> float:
        """Return how fast the fire's own time passes after a frame, 1 on average."""
        if self.settings.frames < 2:
            return 1.0
        at = frame if self.settings.loop else min(frame, self.settings.frames - 2)
        following = self.frame_times[(at + 1) % self.settings.frames]
        return float((following - self.frame_times[at]) % self.period)

    @classmethod
    def of(cls, profile: Profile, settings: ProfileFireSettings) -> "GeneratedFire":
        """Generate a fire, not yet calibrated."""
        grid, sides, shared = profile.grid, profile.sides, settings.generation
        wind = WindResponse.of(shared.wind, shared.frames, shared.fps, shared.loop)
        base_curve = peripheral_curve(1.0, sides[-1].half_width / sides[0].half_width)
        azimuths = math.pi * ((np.arange(settings.slices) + 0.5) / settings.slices - 0.5)
        slice_sides = (np.abs(azimuths) > math.pi / 4).astype(np.intp) * (len(sides) - 1)
        rise = rise_time(grid.rows_above / grid.cells_per_height, profile.rise_speed)
        seconds = min(max(rise, _MIN_LIFETIME), _MAX_LIFETIME)
        sequences = tuple(
            FrameSequence.of(side, shared.fps, profile.playback_speed, seconds) for side in sides
        )
        lifetime = min(sequence.lifetime for sequence in sequences)
        if shared.loop:
            lifetime = min(lifetime, shared.frames)
        # What plays once has risen before its first frame already, and its end meets nothing.
        period = shared.frames if shared.loop else shared.frames + lifetime
        slice_tracks = _slice_tracks(profile, settings.slices)
        particles = Particles.random(
            shared.seed, azimuths, settings.particles, lifetime, period, base_curve
        )
        tracks = _tracks(profile, sequences, period, wind, azimuths, slice_tracks, shared.seed)
        front_sway, side_sway = (
            PlanarSway.of(profile, k, sequences[-k], rise, lifetime, period, wind, shared.seed)
            for k in (0, 1)
        )
        return cls(
            profile, shared, wind, base_curve, azimuths, slice_sides, slice_tracks, particles,
            sequences, tracks, _particle_segments(particles, slice_sides, slice_tracks, tracks),
            (front_sway, side_sway), tuple(_autocorrelation_map(side.detail) for side in sides),
            rise, np.arange(shared.frames, dtype=np.float64), 1.0, 0.0,
        )  # fmt: skip


def _slice_tracks(profile: Profile, slices: int) -> NDArray[np.intp]:
    """Return the playback track of each slice: more of them the wider the fire."""
    width = _TRACK_WIDTH * max(profile.front.detail.correlation_length, 1.0)
    across = 2.4 * profile.grid.cells_per_half / width
    number = min(max(round(across), 2), _MAX_TRACKS, slices)
    return np.arange(slices) * number // slices


def _tracks(
    profile: Profile,
    sequences: tuple[FrameSequence, ...],
    period: int,
    wind: WindResponse,
    azimuths: NDArray[np.float64],
    slice_tracks: NDArray[np.intp],
    seed: int,
) -> Tracks:
    """Return the playback tracks; each leans in the wind as the mean of its slices' planes."""
    number = int(slice_tracks.max()) + 1
    means = [float(azimuths[slice_tracks == track].mean()) for track in range(number)]
    return tuple(
        tuple(
            playback_track(side, sequence, period, wind, azimuth, seed, track)
            for track, azimuth in enumerate(means)
        )
        for side, sequence in zip(profile.sides, sequences, strict=True)
    )


def _particle_segments(
    particles: Particles,
    slice_sides: NDArray[np.intp],
    slice_tracks: NDArray[np.intp],
    tracks: Tracks,
) -> NDArray[np.intp]:
    """Return the segment each particle shows: the last that began before its birth."""
    shown = np.zeros(len(particles.birth), np.intp)
    for k, (side, track) in enumerate(zip(slice_sides, slice_tracks, strict=True)):
        starts = [segment.start for segment in tracks[side][track]]
        here = particles.slice == k
        last = np.searchsorted(starts, particles.birth[here], side="right") - 1
        shown[here] = last % len(starts)
    return shown


def _autocorrelation_map(detail: DetailModel) -> Plane:
    """(rows, columns) 0..1: correlation of a cell's scores with those one frame later."""
    alike = np.zeros(detail.scores.shape[1:], np.float32)
    for before, after in itertools.pairwise(detail.scores):
        alike += (before.astype(np.float32) - 128) * (after.astype(np.float32) - 128)
    alike /= np.float32((detail.count - 1) * SCORE_UNIT**2)
    return as_plane(np.clip(cv2.GaussianBlur(alike, (0, 0), 2.0), 0, 1))
