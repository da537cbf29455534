"""A fire as it burns: what all cameras that look at it share."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Plane
from fire_atlas.profile.face import kinship
from fire_atlas.profile.force import Weather
from fire_atlas.profile.model import Profile
from fire_atlas.profile.particles import Particles, peripheral_curve, time_to
from fire_atlas.profile.pose import resting
from fire_atlas.profile.splices import Reel, Splice, splices_of
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
        rests: By side, (NODES,) where the middle is on average, and (frames, NODES) for a while.
        kinships: By side, (rows, columns): how much a frame has in common with the next.
        climb: Seconds in which a particle would reach the top at the clip's own speed.
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
    rests: tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...]
    kinships: tuple[Plane, ...]
    climb: float

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
        offsets = [side.face.pose.offset for side in sides]
        rests = tuple(
            (offset.mean(axis=0), resting(offset, side.closed))
            for offset, side in zip(offsets, sides, strict=True)
        )
        return cls(
            profile, asked, weather, curve, planes, seen, clocks, particles, reels, splices,
            _shown(particles, seen, clocks, splices), rests,
            tuple(kinship(side.face) for side in sides), climb,
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
