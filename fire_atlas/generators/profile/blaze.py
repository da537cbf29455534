"""A fire as it burns: what all cameras that look at it share."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Plane
from fire_atlas.generators.profile.face import kinship
from fire_atlas.generators.profile.force import Weather
from fire_atlas.generators.profile.model import Profile
from fire_atlas.generators.profile.particles import Particles, peripheral_curve, time_to
from fire_atlas.generators.profile.splices import Reel, Splice, splices_of
from fire_atlas.generators.profile.sway import Swing
from fire_atlas.recipe.wind import Wind

_LONGEST, _SHORTEST = 1.6, 0.4
"""Seconds a particle lives, at most and at least."""

_CROSSING = 1.5
"""A clock is shared by slices whose detail is alike: this many breadths across."""

_MOST_CLOCKS = 4
"""More than this many parts of a clip side by side are a crowd, no fire."""


@dataclass(frozen=True, slots=True)
class Burning:
    """What is asked of a fire.

    Attributes:
        seed: Of the recipe.
        frames: Length of the result.
        fps: Its frames per second.
        loop: Whether its end is to meet its beginning.
        slices: Vertical slices round the axis.
        particles: Particles alive in each.
        wind: What blows.
    """

    seed: int
    frames: int
    fps: float
    loop: bool
    slices: int
    particles: int
    wind: Wind


@dataclass(frozen=True, slots=True)
class Blaze:
    """A fire in space and time.

    Attributes:
        profile: What was learnt of it.
        asked: What is asked of it.
        weather: What the wind does to it.
        curve: Outline of its base, half widths of the front.
        planes: (slices,) azimuth of each slice, radians, within 90 degrees of the front.
        sides: (slices,) which of the profile's sides each slice shows.
        clocks: (slices,) which clock each goes by.
        particles: All of them.
        reels: How each side's clip is played.
        splices: By side and clock.
        shown: (particles,) number of the splice, among those of its clock, that each shows.
        swings: How it sways in the plane of the front, and at a right angle to it.
        kinships: By side, (rows, columns): how much a frame has in common with the next.
        climb: Seconds in which a particle would reach the top at the clip's own speed.
        times: (frames,) of each frame in the fire's own time, which is counted in frames too.
        gain: How far it sways, of what its clip does.
        bias: Degrees by which it leans to the right of the front all the time.
    """

    profile: Profile
    asked: Burning
    weather: Weather
    curve: CubicSpline
    planes: NDArray[np.float64]
    sides: NDArray[np.intp]
    clocks: NDArray[np.intp]
    particles: Particles
    reels: tuple[Reel, ...]
    splices: tuple[tuple[tuple[Splice, ...], ...], ...]
    shown: NDArray[np.intp]
    swings: tuple[Swing, Swing]
    kinships: tuple[Plane, ...]
    climb: float
    times: NDArray[np.float64]
    gain: float
    bias: float

    @property
    def period(self) -> int:
        """Frames after which all begins anew."""
        return self.particles.period

    def haste(self, frame: int) -> float:
        """How fast the fire's own time goes by after a frame, 1 on average."""
        if self.asked.frames < 2:
            return 1.0
        at = frame if self.asked.loop else min(frame, self.asked.frames - 2)
        return float((self.times[(at + 1) % self.asked.frames] - self.times[at]) % self.period)

    @classmethod
    def of(cls, profile: Profile, asked: Burning) -> "Blaze":
        """Light it."""
        grid, sides = profile.grid, profile.sides
        weather = Weather.of(asked.wind, asked.frames, asked.fps, asked.loop)
        front = sides[0].face.half
        curve = peripheral_curve(1.0, sides[-1].face.half / front)
        planes = math.pi * ((np.arange(asked.slices) + 0.5) / asked.slices - 0.5)
        seen = (np.abs(planes) > math.pi / 4).astype(np.intp) * (len(sides) - 1)
        climb = time_to(grid.up / grid.per_height, profile.rise)
        seconds = min(max(climb, _SHORTEST), _LONGEST)
        reels = tuple(Reel.of(side, asked.fps, profile.pace, seconds) for side in sides)
        life = min(reel.life for reel in reels)
        if asked.loop:
            life = min(life, asked.frames)
        # What plays once is lit before its first frame, and its end meets nothing.
        period = asked.frames if asked.loop else asked.frames + life
        clocks = _clocks(profile, asked.slices)
        splices = tuple(
            tuple(
                splices_of(
                    side, reel, period, weather, float(planes[clocks == clock].mean()),
                    asked.seed, clock,
                )
                for clock in range(int(clocks.max()) + 1)
            )
            for side, reel in zip(sides, reels, strict=True)
        )  # fmt: skip
        particles = Particles.random(asked.seed, planes, asked.particles, life, period, curve)
        front_swing, side_swing = (
            Swing.of(
                sides[-k], reels[-k], profile.rise, climb, life, period, weather, asked.seed, k
            )
            for k in (0, 1)
        )
        return cls(
            profile, asked, weather, curve, planes, seen, clocks, particles, reels, splices,
            _shown(particles, seen, clocks, splices), (front_swing, side_swing),
            tuple(kinship(side.face) for side in sides), climb,
            np.arange(asked.frames, dtype=np.float64), 1.0, 0.0,
        )  # fmt: skip


def _shown(
    particles: Particles,
    sides: NDArray[np.intp],
    clocks: NDArray[np.intp],
    splices: tuple[tuple[tuple[Splice, ...], ...], ...],
) -> NDArray[np.intp]:
    """Return the splice each particle shows: the last that began before it was born."""
    shown = np.zeros(len(particles.born), np.intp)
    for k, (side, clock) in enumerate(zip(sides, clocks, strict=True)):
        starts = [splice.start for splice in splices[side][clock]]
        here = particles.slice == k
        last = np.searchsorted(starts, particles.born[here], side="right") - 1
        shown[here] = last % len(starts)
    return shown


def _clocks(profile: Profile, slices: int) -> NDArray[np.intp]:
    """Return the clock of each slice: as many clocks as the fire is breadths wide."""
    across = 2.4 * profile.grid.per_half / (_CROSSING * max(profile.front.face.breadth, 1.0))
    number = min(max(round(across), 2), _MOST_CLOCKS, slices)
    return np.arange(slices) * number // slices
