"""A generated fire in space and time, independent of any camera."""

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
"""Limits on the lifetime of a particle, seconds."""

_TRACK_WIDTH = 1.5
"""Width that one playback track fills, in correlation lengths of the detail."""

_MAX_TRACKS = 4
"""Maximum number of tracks: more parts of a clip side by side look like several fires."""

Tracks = tuple[tuple[tuple[ClipSegment, ...], ...], ...]
"""Segments as ``tracks[side][track][number]``, in the order of playing."""


@dataclass(frozen=True, slots=True)
class ProfileFireSettings:
    """Settings of a fire that is generated from a profile.

    Attributes:
        generation: Settings that all fire generators share.
        slices: Number of vertical slices round the axis.
        particles: Number of particles alive in each slice.
    """

    generation: GenerationSettings
    slices: int
    particles: int


@dataclass(frozen=True, slots=True)
class GeneratedFire:
    """A generated fire in space and time; its cameras share it.

    Attributes:
        profile: The profile it is generated from.
        settings: Length, frame rate, wind and seed.
        wind: Its response to the wind.
        base_curve: Outline of its base seen from above, half widths of the front.
        slice_azimuths: (slices,) directions of the slices, radians, within ±π/2 of the front.
        slice_sides: (slices,) index of the profile's side that each slice shows.
        slice_tracks: (slices,) index of the playback track of each slice.
        particles: All particles.
        sequences: How the clip of each side is played.
        tracks: The playback tracks.
        particle_segments: (particles,) index, in its track, of the segment that each shows.
        sways: Sway in the plane of the front, and in the plane at a right angle to it.
        autocorrelations: By side, (rows, columns) correlation of scores one frame apart.
        rise_time: Seconds a particle takes to the top of the grid.
        frame_times: (frames,) time of each frame, in frames of the fire's own time.
        sway_gain: Calibrated factor of the clip's sway.
        lean_bias: Calibrated degrees added to the lean, to the right of the front.
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
        """Number of frames after which the fire repeats."""
        return self.particles.period

    def time_rate(self, frame: int) -> float:
        """Return the speed of the fire's own time after a frame; 1 on average."""
        if self.settings.frames < 2:
            return 1.0
        at = frame if self.settings.loop else min(frame, self.settings.frames - 2)
        following = self.frame_times[(at + 1) % self.settings.frames]
        return float((following - self.frame_times[at]) % self.period)

    @classmethod
    def of(cls, profile: Profile, settings: ProfileFireSettings) -> "GeneratedFire":
        """Generate a fire that is not calibrated yet."""
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
        # A fire that plays once has fully risen before frame 0, and its end need not fit its start.
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
    """Return the playback track of each slice. Wider fires have more tracks."""
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
    """Return the playback tracks; the wind leans each as it does the mean plane of its slices."""
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
    """Return the segment each particle shows: the last one started before its birth."""
    shown = np.zeros(len(particles.birth), np.intp)
    for k, (side, track) in enumerate(zip(slice_sides, slice_tracks, strict=True)):
        starts = [segment.start for segment in tracks[side][track]]
        here = particles.slice == k
        last = np.searchsorted(starts, particles.birth[here], side="right") - 1
        shown[here] = last % len(starts)
    return shown


def _autocorrelation_map(detail: DetailModel) -> Plane:
    """Return the correlation (rows, columns), 0..1, of each cell's scores one frame apart."""
    correlation = np.zeros(detail.scores.shape[1:], np.float32)
    for before, after in itertools.pairwise(detail.scores):
        correlation += (before.astype(np.float32) - 128) * (after.astype(np.float32) - 128)
    correlation /= np.float32((detail.count - 1) * SCORE_UNIT**2)
    return as_plane(np.clip(cv2.GaussianBlur(correlation, (0, 0), 2.0), 0, 1))
