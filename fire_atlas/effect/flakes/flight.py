"""Flight of the flakes: each is carried by the field, with inertia, jitter and weight."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane
from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.effect.flakes.emission import TICK, Spawns
from fire_atlas.effect.flakes.scatter import scatter_turns

Column = NDArray[np.float64]

_MOST_ROWS = 30000

_LAG_BY_BULK = 0.35
"""A flake one standard deviation larger than usual lags e^0.35 times as long."""

_THROW = 0.12
"""Seconds in which the air stops what a burst has thrown."""

_ESCAPES = 0.15
"""Share of a throw that the gas of the flame does not hold."""

_PACE = 0.2
"""Seconds over which a flake's speed is taken for its colour: metal does not cool in a frame."""

_TAKES_ON = 1 - math.exp(-TICK / _PACE)
"""Share of a flake's speed that its pace takes on in a tick."""

_STRAY = 0.4
"""Seconds in which a flake begins to meander; more to the sides than up and down."""


@dataclass(frozen=True, slots=True)
class Flight:
    """How flakes fly.

    Attributes:
        seed: Of the recipe, for the jitter.
        scatter: k of eq. 13.
        lag: Seconds in which a flake of middle size takes on the field's velocity.
        gravity: Downward acceleration, px/s².
        wander: Speed (rms) at which eddies too small for the grid move a flake outside the flame,
            px/s: turbulence is strong after combustion (section III-A).
        streak: Seconds of its way that a flake is drawn out over; what is drawn of it leaves the
            frame as much later.
        most: Most flakes alive at once.
        width, height: Frame, px: what has left it is gone.
    """

    seed: int
    scatter: float
    lag: float
    gravity: float
    wander: float
    streak: float
    most: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Swarm:
    """Flakes alive at one moment, by id. Arrays (flakes,) of px, px/s and s.

    ``pace`` is the speed of each, px/s, as it was of late.
    """

    id: NDArray[np.int64]
    x: Column
    y: Column
    vx: Column
    vy: Column
    pace: Column
    age: Column

    @classmethod
    def empty(cls) -> Self:
        """No flakes."""
        return cls(np.empty(0, np.int64), *(np.empty(0) for _ in fields(cls)[1:]))

    def where(self, kept: NDArray[np.bool_]) -> "Swarm":
        """Only the flakes of a mask."""
        places = np.flatnonzero(kept)
        if len(places) == len(kept):
            return self
        return Swarm(*(getattr(self, f.name).take(places) for f in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence["Swarm"]) -> Self:
        """All of ``parts``, one after the other."""
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))


def fly(spawns: Spawns, field: FieldRecord, frames: int, flight: Flight) -> Iterator[Swarm]:
    """Yield the flakes of every frame; flake i is entry i of ``spawns``.

    Flakes move in ticks of 1/60 s; between two ticks a frame sees them on the straight line.
    """
    swarm, inertia = Swarm.empty(), _Inertia.of(spawns, flight)
    born = np.searchsorted(spawns.tick, np.arange(math.ceil(frames / field.fps / TICK) + 2))
    frame = 0
    for tick in range(len(born) - 1):
        air = field.at(tick * TICK)
        swarm = _hatch(swarm, spawns, int(born[tick]), int(born[tick + 1]), field, air, flight)
        moved = _step(swarm, spawns, inertia, field, air, tick, flight)
        while frame < frames and frame / field.fps / TICK < tick + 1:
            part = frame / field.fps / TICK - tick
            yield _between(swarm, moved, part, spawns)
            frame += 1
        swarm = moved.where(_stays(moved, spawns, flight))


@dataclass(frozen=True, slots=True)
class _Inertia:
    """How slowly each flake takes on the field's velocity. Arrays (flakes,).

    Attributes:
        keeps: Share of the difference that is left after a tick.
        falls: Speed at which gravity makes it fall in the end, px/s.
    """

    keeps: Column
    falls: Column

    @classmethod
    def of(cls, spawns: Spawns, flight: Flight) -> Self:
        """Return the inertia of each of ``spawns``."""
        lag = flight.lag * np.exp(_LAG_BY_BULK * spawns.bulk)
        return cls(np.exp(-TICK / np.maximum(lag, 1e-6)), flight.gravity * lag)


def _sample(field: FieldRecord, air: NDArray[np.float32], x: Column, y: Column) -> Column:
    """u, v and lit, (3, flakes), of the field's ``air`` at places in px: bilinear between the
    centres of cells, whose border goes on outside."""
    places = as_plane(x / field.cell - 0.5)[:, None], as_plane(y / field.cell - 0.5)[:, None]
    found = np.empty((len(x), 3))
    # OpenCV's pictures have at most 32,767 rows: more flakes are asked for in several parts.
    for start in range(0, len(x), _MOST_ROWS):
        part = slice(start, start + _MOST_ROWS)
        found[part] = cv2.remap(
            air, places[0][part], places[1][part], cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )[:, 0]  # fmt: skip
    return np.ascontiguousarray(found.T)


def _hatch(
    swarm: Swarm,
    spawns: Spawns,
    first: int,
    last: int,
    field: FieldRecord,
    air: NDArray[np.float32],
    flight: Flight,
) -> Swarm:
    """Add the flakes ``first`` .. ``last`` of ``spawns``, as far as there is room for them."""
    last = min(last, first + max(flight.most - len(swarm.id), 0))
    if first == last:
        return swarm
    new = slice(first, last)
    vx, vy, _ = _sample(field, air, spawns.x[new], spawns.y[new])
    ids = np.arange(first, last, dtype=np.int64)
    pace, age = np.hypot(vx, vy), np.zeros(len(ids))
    hatched = Swarm(ids, spawns.x[new], spawns.y[new], vx, vy, pace, age)
    return Swarm.joined([swarm, hatched])


def _step(
    swarm: Swarm,
    spawns: Spawns,
    inertia: _Inertia,
    field: FieldRecord,
    air: NDArray[np.float32],
    tick: int,
    flight: Flight,
) -> Swarm:
    """One tick: v̇ = (u − v)/lag + g, solved exactly; then the jitter; then the way."""
    *u, lit = _sample(field, air, swarm.x, swarm.y)
    if flight.lag > 0:
        keeps = inertia.keeps.take(swarm.id)
        vx = u[0] + (swarm.vx - u[0]) * keeps
        fall = u[1] + inertia.falls.take(swarm.id)
        vy = fall + (swarm.vy - fall) * keeps
    else:
        vx, vy = u
    cos, sin = scatter_turns(flight.seed, tick, swarm.id, flight.scatter)
    vx, vy = vx * cos - vy * sin, vx * sin + vy * cos
    own_x, own_y = _own_motion(swarm, spawns, np.square(np.square(1 - lit)), flight)
    all_x, all_y = vx + own_x, vy + own_y
    return replace(
        swarm,
        x=swarm.x + all_x * TICK,
        y=swarm.y + all_y * TICK,
        vx=vx,
        vy=vy,
        pace=swarm.pace + (np.hypot(all_x, all_y) - swarm.pace) * _TAKES_ON,
        age=_since(spawns.tick.take(swarm.id), tick + 1),
    )


def _own_motion(
    swarm: Swarm, spawns: Spawns, outside: Column, flight: Flight
) -> tuple[Column, Column]:
    """Velocity of each flake that its neighbours do not share, px/s.

    Its weight; a burst's throw, which the air stops; and the meandering that keeps flakes of one
    place from flying in a line. The last two as far as a flake is ``outside`` the flame (0..1), in
    which the gas carries it along; but some of a throw escapes.
    """
    flung = np.exp(-swarm.age / _THROW)
    speed = math.sqrt(2) * flight.wander * np.minimum(swarm.age / _STRAY, 1.0)
    turn = 2 * math.pi * spawns.wander.take(swarm.id) * swarm.age
    aside = speed * _sine(turn + spawns.wander_x.take(swarm.id))
    down = 0.5 * speed * _sine(turn + spawns.wander_y.take(swarm.id))
    fall = spawns.sink.take(swarm.id) * (1 - flung)
    flung *= np.maximum(outside, _ESCAPES)
    return (
        spawns.throw_x.take(swarm.id) * flung + outside * aside,
        spawns.throw_y.take(swarm.id) * flung + outside * down + fall,
    )


def _sine(angle: Column) -> NDArray[np.float32]:
    """Sine of angles, rad, in single precision: several times as fast, and nobody sees 1e-6."""
    return np.sin(as_plane(angle))


def _since(born: NDArray[np.int64], tick: int) -> Column:
    """Age, s, at ``tick``; counted, because a sum of ticks would drift."""
    return np.multiply(tick - born, TICK, dtype=np.float64)


def _between(before: Swarm, after: Swarm, part: float, spawns: Spawns) -> Swarm:
    """Flakes ``part`` of a tick after ``before``, without those that have cooled by then.

    Their velocity is that of their way: what they do of their own is part of it.
    """
    age = before.age + part * TICK
    way_x, way_y = after.x - before.x, after.y - before.y
    seen = replace(
        after,
        x=before.x + way_x * part,
        y=before.y + way_y * part,
        vx=way_x / TICK,
        vy=way_y / TICK,
        age=age,
    )
    return seen.where(age < spawns.life.take(before.id))


def _stays(swarm: Swarm, spawns: Spawns, flight: Flight) -> NDArray[np.bool_]:
    margin = spawns.size.take(swarm.id)
    if flight.streak > 0:
        margin = margin + np.hypot(swarm.vx, swarm.vy) * (flight.streak / 2)
    stays: NDArray[np.bool_] = (
        (swarm.age < spawns.life.take(swarm.id))
        & (swarm.x > -margin)
        & (swarm.x < flight.width + margin)
        & (swarm.y > -margin)
        & (swarm.y < flight.height + margin)
    )
    return stays
