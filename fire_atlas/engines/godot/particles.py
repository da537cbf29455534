"""Statistics of flakes as settings of a GPUParticles2D of Godot, whose sparks the game may move."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import REC709
from fire_atlas.effect.flakes.drawing import HALO_WIDTH
from fire_atlas.effect.flakes.statistics import flights_of
from fire_atlas.effect.flakes.tracks import Tracks, as_drawn

_AGES = 8
"""Number of ages at which the mean light is measured, from birth to the end of life."""

_LEVELS = 8
"""Number of levels of brightness, from the dimmest to the brightest sparks."""

_LEAST_SHARE = 0.05
"""Least value of a range as a share of its middle: nothing may be of size or duration 0."""

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ParticleTiming:
    """How many particles there are, and for how long.

    Attributes:
        amount: Particles that may be alive at once.
        amount_ratio: Share of them that is emitted.
        lifetime: Longest life, s; ``amount`` · ``amount_ratio`` are born in this time.
        lifetime_randomness: Share of ``lifetime`` that lives may be shorter, evenly spread.
        one_shot: Whether all are born at once, as in an explosion.
        explosiveness: Share of ``lifetime`` in which none is born, before its end.
    """

    amount: int
    amount_ratio: float
    lifetime: float
    lifetime_randomness: float
    one_shot: bool
    explosiveness: float


@dataclass(frozen=True, slots=True)
class ParticleMotion:
    """Where particles are born and how they fly.

    Attributes:
        centre, extents: Middle, and half width and height, of the box of births, px from the pivot.
        direction: Unit vector of the mean direction of flights, y down.
        spread: Greatest angle from it, degrees.
        speeds: Range of speeds at birth, px/s.
        gravity: Acceleration, px/s².
    """

    centre: tuple[float, float]
    extents: tuple[float, float]
    direction: tuple[float, float]
    spread: float
    speeds: tuple[float, float]
    gravity: tuple[float, float]


@dataclass(frozen=True, slots=True)
class ParticleLook:
    """What particles look like.

    Attributes:
        sizes: Range of widths, px.
        stretch: Length of a spark over its width.
        tail: Light at the tail of a spark relative to that at its head; -1: a hard square.
        colours: Mean light, linear r, g, b, at evenly spaced ages, (ages, 3).
        brightness: Light relative to that of every so many sparks, from the dimmest, (levels,).
    """

    sizes: tuple[float, float]
    stretch: float
    tail: float
    colours: Values
    brightness: Values


@dataclass(frozen=True, slots=True)
class ParticleSettings:
    """Settings of particles that are born, fly and look as the flakes of an animation, in the mean.

    What varies evenly between two values has the median and the quartiles of the flakes.

    Attributes:
        timing: How many there are, and for how long.
        motion: Where they are born and how they fly.
        look: What they look like.
        bounds: (x, y, width, height) around all particles, px from the pivot.
    """

    timing: ParticleTiming
    motion: ParticleMotion
    look: ParticleLook
    bounds: tuple[int, int, int, int]


def particle_settings(tracks: Tracks, pivot: tuple[float, float]) -> ParticleSettings | None:
    """Return the settings of particles like the flakes of ``tracks``; None without flakes.

    Args:
        tracks: Of one animation.
        pivot: Its pivot, px.
    """
    drawn = as_drawn(tracks)
    flights = flights_of(drawn)
    if not flights:
        return None
    column = {name: i for i, name in enumerate(drawn.columns)}
    timing = _timing(tracks, np.array([flight[0, column["life"]] for flight in flights]))
    motion = _motion(flights, column, pivot)
    look = _look(flights, column, hard=tracks.hard)
    seconds = timing.lifetime
    way = motion.speeds[1] * seconds + math.hypot(*motion.gravity) * seconds**2 / 2
    bounds = _bounds(motion, way + look.sizes[1] * look.stretch * HALO_WIDTH)
    return ParticleSettings(timing, motion, look, bounds)


def _timing(tracks: Tracks, lives: Values) -> ParticleTiming:
    """Return the timing of flights with these lives, s."""
    shortest, lifetime = _range(lives)
    emission = float(np.quantile(_birth_times(tracks), 0.95)) + 1 / tracks.fps
    one_shot = not tracks.loop and emission <= lifetime
    seconds = len(tracks.frames) / tracks.fps if tracks.loop else emission
    alive = len(lives) * (1.0 if one_shot else lifetime / seconds)
    amount = max(math.ceil(alive), 1)
    return ParticleTiming(
        amount=amount,
        amount_ratio=alive / amount,
        lifetime=lifetime,
        lifetime_randomness=1 - shortest / lifetime,
        one_shot=one_shot,
        explosiveness=1 - emission / lifetime if one_shot else 0.0,
    )


def _motion(
    flights: list[Values], column: dict[str, int], pivot: tuple[float, float]
) -> ParticleMotion:
    first, last = (np.stack([flight[i] for flight in flights]) for i in (0, -1))
    places, ends = (rows[:, [column["x"], column["y"]]] - pivot for rows in (first, last))
    centre, extents = _box(places)
    # Embers are born as the gas rises and drift apart later, so that it is their ways that tell.
    direction, spread = _directions(ends - places)
    speeds = _range(np.hypot(first[:, column["vx"]], first[:, column["vy"]]))
    return ParticleMotion(
        centre, extents, direction, spread, speeds, _acceleration(flights, column)
    )


def _look(flights: list[Values], column: dict[str, int], *, hard: bool) -> ParticleLook:
    rows = np.concatenate(flights)
    colours, brightness = _light(flights, column)
    return ParticleLook(
        sizes=_range(np.array([flight[0, column["size"]] for flight in flights])),
        stretch=1.0 if hard else float(np.median(rows[:, column["stretch"]])),
        tail=-1.0 if hard else float(np.median(rows[:, column["tail"]])),
        colours=colours,
        brightness=brightness,
    )


def _range(values: Values) -> tuple[float, float]:
    """Return the ends of an even spread with the median of ``values``, and the distance of their
    quartiles, as far as it stays positive."""
    low, middle, high = np.quantile(values, [0.25, 0.5, 0.75]).tolist()
    half = min(high - low, middle * (1 - _LEAST_SHARE))
    return middle - half, middle + half


def _birth_times(tracks: Tracks) -> Values:
    """Return when flights begin, s."""
    counts = [int((since == 0).sum()) for since in tracks.flight_frames]
    return np.repeat(np.arange(len(counts)), counts) / tracks.fps


def _box(places: Values) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return middle and half size of the box of an even spread with the quartiles of ``places``."""
    low, high = np.quantile(places, [0.25, 0.75], axis=0)
    middle, half = (low + high) / 2, high - low
    return (float(middle[0]), float(middle[1])), (float(half[0]), float(half[1]))


def _directions(ways: Values) -> tuple[tuple[float, float], float]:
    """Return the mean direction, and the angle, degrees, of an even spread about it that has the
    median of ``ways``."""
    x, y = (ways / np.maximum(np.hypot(ways[:, 0], ways[:, 1])[:, None], 1e-9)).mean(axis=0)
    length = math.hypot(x, y)
    if length < 1e-6:
        return (0.0, -1.0), 180.0
    mean = np.array([x, y]) / length
    off = np.arctan2(ways @ [-mean[1], mean[0]], ways @ mean)
    spread = 2 * math.degrees(float(np.median(np.abs(off))))
    return (float(mean[0]), float(mean[1])), min(spread, 180.0)


def _acceleration(flights: list[Values], column: dict[str, int]) -> tuple[float, float]:
    """Return the steady acceleration that leads flights nearest to their ways, px/s²."""
    ways, squares = np.zeros(2), 0.0
    for flight in flights:
        time = (flight[:, column["age"]] - flight[0, column["age"]])[:, None]
        place = flight[:, [column["x"], column["y"]]]
        velocity = flight[0, [column["vx"], column["vy"]]]
        off = place - place[0] - velocity * time
        ways += (2 * off * time * time).sum(axis=0)
        squares += float((time**4).sum())
    x, y = (ways / max(squares, 1e-9)).tolist()
    return x, y


def _light(flights: list[Values], column: dict[str, int]) -> tuple[Values, Values]:
    """Return the mean light at each age, and how bright flights are relative to it."""
    rows = np.concatenate(flights)
    light = rows[:, [column[name] for name in "rgb"]] * rows[:, [column["a"]]]
    age = np.minimum(rows[:, column["age"]] / rows[:, column["life"]] * _AGES, _AGES - 1)
    which = age.astype(np.int64)
    counts = np.bincount(which, minlength=_AGES)
    sums = np.stack([np.bincount(which, light[:, i], _AGES) for i in range(3)], axis=1)
    seen = np.flatnonzero(counts)
    means = sums[seen] / counts[seen, None]
    ages = np.arange(_AGES)
    colours = np.stack([np.interp(ages, seen, means[:, i]) for i in range(3)], axis=1)
    ends = np.cumsum([len(flight) for flight in flights])[:-1]
    own, usual = (np.add.reduceat(rgb @ REC709, [0, *ends]) for rgb in (light, colours[which]))
    relative = np.sort(own / np.maximum(usual, 1e-9))
    levels = np.quantile(relative, (np.arange(_LEVELS) + 0.5) / _LEVELS)
    return colours, levels / max(float(levels.mean()), 1e-9)


def _bounds(motion: ParticleMotion, reach: float) -> tuple[int, int, int, int]:
    """Return the box that particles reach which get so many px away from where they are born."""
    box = zip(motion.centre, motion.extents, strict=True)
    ends = [(math.floor(c - e - reach), math.ceil(c + e + reach)) for c, e in box]
    (left, right), (top, bottom) = ends
    return left, top, right - left, bottom - top
