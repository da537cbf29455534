"""Flight: embers move with the buoyancy field, with inertia, jitter and gravity (eq. 13).

Sparks are thrown and fly on their own (``ballistics.py``). In a fire with depth, flakes fly once in
three dimensions, in the axes of its front, and are seen from every side (``particles.py``).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.pixels import as_plane
from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.effect.flakes.ballistics import Ballistics
from fire_atlas.effect.flakes.emission import SPARK, TICK, Spawns
from fire_atlas.effect.flakes.particles import FlakeView, ParticleState
from fire_atlas.vision.warp import sample_at

Column = NDArray[np.float64]

_REMAP_LIMIT = 30000
"""Maximum number of places sampled per call: OpenCV's pictures have at most 32,767 rows."""

_LAG_PER_SCORE = 0.35
"""A flake one standard deviation larger than the mean lags e^0.35 times as long."""

_COLOUR_LAG = 0.2
"""Time constant of the speed that decides a flake's colour, s: embers do not cool in one frame."""

_COLOUR_GAIN = 1 - math.exp(-TICK / _COLOUR_LAG)
"""Fraction of the change in a flake's speed that ``smoothed_speed`` follows in a tick."""

_EXPOSURE_LAG = 0.12
"""Time constant with which an ember that has left the flame begins to move in its own way, s."""

_EXPOSURE_GAIN = 1 - math.exp(-TICK / _EXPOSURE_LAG)
"""Fraction of the change of its surroundings that ``exposure`` follows in a tick."""

_WANDER = 1.5
"""Speed of an ember's own turbulent motion relative to that of the eddies around it."""

_ANGLES = 1 << 13
"""Number of jitter angles drawn per tick. Flakes whose ids are this far apart share one, unseen."""


@dataclass(frozen=True, slots=True)
class FlightSettings:
    """How flakes fly.

    Attributes:
        seed: The recipe's seed, for the jitter.
        scatter: k of eq. 13.
        lag: Time constant with which a flake of median size follows the field's velocity, s.
        gravity: Downward acceleration, px/s².
        turbulence: Speed (rms) at which eddies too small for the grid move a flake outside the
            flame, px/s: turbulence is strong after combustion (section III-A).
        streak: Part of a flake's path, s, that its streak shows; a flake is kept until its whole
            streak has left the frame.
        max_alive: Maximum number of flakes alive at once.
        width, height: Frame size, px; flakes that have left the frame are removed.
        views: The views of a fire with depth: flakes are removed that have left all their frames.
            They do not leave a tile by its sides, but fly on over its copies.
        own_motion: Factor of an ember's velocity relative to the field.
    """

    seed: int
    scatter: float
    lag: float
    gravity: float
    turbulence: float
    streak: float
    max_alive: int
    width: int
    height: int
    views: tuple[FlakeView, ...] = ()
    own_motion: float = 1.0


@dataclass(frozen=True, slots=True)
class FlightField:
    """The field that flakes fly in.

    Attributes:
        front: As seen from the front.
        side: As seen from the right of the front, at a right angle to it, if the fire has depth.
        axis: x of the fire's vertical axis in both, px.
    """

    front: FieldRecord
    side: FieldRecord | None = None
    axis: float = 0.0

    def at_time(self, time: float) -> "_FieldSampler":
        """Return the field at ``time`` s."""
        planes = self.front.interpolated(time)
        side = None if self.side is None else self.side.interpolated(time)
        return _FieldSampler(planes, side, self.axis, self.front.cell, self.front.tiles)


def fly(
    spawns: Spawns, air: FlightField, frames: int, settings: FlightSettings
) -> Iterator[ParticleState]:
    """Yield the flakes of every frame; flake i is entry i of ``spawns``.

    Flakes move in ticks of 1/60 s; frames between two ticks interpolate linearly.
    """
    model, state = _FlightModel.of(spawns, settings, air), ParticleState.empty()
    fps = air.front.fps
    spawned = np.searchsorted(spawns.tick, np.arange(math.ceil(frames / fps / TICK) + 2))
    frame = 0
    for tick in range(len(spawned) - 1):
        field = air.at_time(tick * TICK)
        state = model.spawn(state, int(spawned[tick]), int(spawned[tick + 1]), field)
        moved = model.step(state, field, tick)
        while frame < frames and frame / fps / TICK < tick + 1:
            yield model.between(state, moved, frame / fps / TICK - tick)
            frame += 1
        state = moved.where(model.is_alive(moved))


@dataclass(frozen=True, slots=True)
class _FieldSampler:
    """The field at one moment: planes (rows, columns, 3) are u, v (px/s), brightness (0..1) of each
    ``cell`` px, as seen from the front, which may be a tile, and, if the fire has depth, from its
    right side."""

    front: NDArray[np.float32]
    side: NDArray[np.float32] | None
    axis: float
    cell: int
    tiles: bool

    def at(self, x: Column, y: Column, z: Column) -> tuple[Column, Column, Column, Column]:
        """Return u, v, w (px/s, right, down, towards the viewer) and brightness, (flakes,) each.

        Each view shows the mean of what lies behind one another. So u is that of the front, w that
        of the side, and v the mean of both. A flake is in the flame if it is in both views.
        """
        u, v, brightness = self._sampled(self.front, x, y, tiles=self.tiles)
        if self.side is None:
            return u, v, np.zeros_like(u), brightness
        away, also, seen = self._sampled(self.side, self.axis - z, y)
        return u, (v + also) / 2, -away, np.minimum(brightness, seen)

    def _sampled(
        self, planes: NDArray[np.float32], x: Column, y: Column, *, tiles: bool = False
    ) -> Column:
        """Return the planes, (3, flakes), at places in px: bilinear between cell centres, continued
        outside by the border's values; of a tile, by its copies."""
        map_x, map_y = (as_plane(c / self.cell - 0.5)[:, None] for c in (x, y))
        found = np.empty((len(x), 3))
        for start in range(0, len(x), _REMAP_LIMIT):
            part = slice(start, start + _REMAP_LIMIT)
            found[part] = sample_at(planes, map_x[part], map_y[part], tiles=tiles)[:, 0]
        return np.ascontiguousarray(found.T)


@dataclass(frozen=True, slots=True)
class _FlightModel:
    """Constants of a flight, and the time step that changes the flakes' state.

    Attributes:
        spawns: All flakes that are ever spawned.
        settings: How they fly.
        retained: (flakes,) fraction of the velocity relative to the field that a tick leaves.
        fall_speed: (flakes,) terminal velocity under the recipe's gravity, px/s.
        thrown: (flakes,) whether each is a spark.
        ballistics: How the sparks fly.
        has_depth: Whether they fly in three dimensions.
    """

    spawns: Spawns
    settings: FlightSettings
    retained: Column
    fall_speed: Column
    thrown: NDArray[np.bool_]
    ballistics: Ballistics
    has_depth: bool

    @classmethod
    def of(cls, spawns: Spawns, settings: FlightSettings, air: FlightField) -> Self:
        """Compute the constants of each flake; larger flakes lag longer behind the field."""
        lag = settings.lag * np.exp(_LAG_PER_SCORE * spawns.size_score)
        retained = np.exp(-TICK / np.maximum(lag, 1e-6))
        ballistics = Ballistics.of(spawns, settings.height, settings.gravity)
        thrown = spawns.kind == SPARK
        fall, has_depth = settings.gravity * lag, air.side is not None
        return cls(spawns, settings, retained, fall, thrown, ballistics, has_depth)

    def spawn(
        self, state: ParticleState, first: int, last: int, field: _FieldSampler
    ) -> ParticleState:
        """Add entries ``first:last`` of the spawns, up to the limit on flakes alive."""
        last = min(last, first + max(self.settings.max_alive - len(state.id), 0))
        if first == last:
            return state
        x, y, z = (
            coordinate[first:last] for coordinate in (self.spawns.x, self.spawns.y, self.spawns.z)
        )
        vx, vy, vz, _ = field.at(x, y, z)
        ids, age = np.arange(first, last, dtype=np.int64), np.zeros(last - first)
        spawned = self._with_sparks(ParticleState(ids, x, y, vx, vy, age, age, age, z, vz))
        speed = self._speed(spawned.vx, spawned.vy, spawned.vz)
        spawned = replace(spawned, smoothed_speed=speed)
        return ParticleState.concatenate([state, spawned])

    def step(self, state: ParticleState, field: _FieldSampler, tick: int) -> ParticleState:
        """Move embers by one tick: v̇ = (u − v)/lag + g, solved exactly; jitter; then x += v dt.

        Sparks are placed where their throw has brought them.
        """
        *u, brightness = field.at(state.x, state.y, state.z)
        vx, vy, vz = u
        if self.settings.lag > 0:
            retained = self.retained.take(state.id)
            vx = u[0] + (state.vx - u[0]) * retained
            target = u[1] + self.fall_speed.take(state.id)
            vy = target + (state.vy - target) * retained
            vz = u[2] + (state.vz - u[2]) * retained
        cos, sin = scatter_rotations(self.settings.seed, tick, state.id, self.settings.scatter)
        if self.has_depth:
            turn = scatter_directions(self.settings.seed, tick, state.id)
            vx, vy, vz = _scattered_in_depth((vx, vy, vz), cos, sin, turn)
        else:
            vx, vy = vx * cos - vy * sin, vx * sin + vy * cos
        outside = np.square(np.square(1 - brightness))
        own_x, own_y, own_z = self._own_velocity(state, u, outside)
        ticks = tick + 1 - self.spawns.tick.take(state.id)  # counted, as summed ages would drift
        moved = self._with_sparks(
            replace(
                state,
                x=state.x + (vx + own_x) * TICK,
                y=state.y + (vy + own_y) * TICK,
                z=state.z + (vz + own_z) * TICK,
                vx=vx,
                vy=vy,
                vz=vz,
                exposure=state.exposure + (outside - state.exposure) * _EXPOSURE_GAIN,
                age=np.multiply(ticks, TICK, dtype=np.float64),
            )
        )
        speed = self._speed(moved.x - state.x, moved.y - state.y, moved.z - state.z) / TICK
        change = (speed - state.smoothed_speed) * _COLOUR_GAIN
        return replace(moved, smoothed_speed=state.smoothed_speed + change)

    def _speed(self, x: Column, y: Column, z: Column) -> Column:
        """Return the lengths of vectors."""
        flat = np.hypot(x, y)
        return np.hypot(flat, z) if self.has_depth else flat

    def _with_sparks(self, state: ParticleState) -> ParticleState:
        """Return the state with all sparks where they are at their age, at their velocity."""
        sparks = np.flatnonzero(self.thrown.take(state.id))
        if not len(sparks):
            return state
        columns = [getattr(state, name).copy() for name in ("x", "y", "z", "vx", "vy", "vz")]
        flown = self.ballistics.at(state.id.take(sparks), state.age.take(sparks))
        for column, now in zip(columns, flown, strict=True):
            column[sparks] = now
        x, y, z, vx, vy, vz = columns
        return replace(state, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)

    def _own_velocity(
        self, state: ParticleState, air: Sequence[Column], outside: Column
    ) -> tuple[Column, Column, Column]:
        """Velocity of each ember relative to the field, px/s, that its neighbours do not share.

        It is the fall at terminal velocity, the drift that is faster or slower than the gas, and
        turbulence, so that neighbours do not fly in a line. All begin slowly ``outside`` the flame
        (0..1), and end at once inside.
        """
        ids, spawns, (u, v, w) = state.id, self.spawns, air
        factor = self.settings.own_motion
        if factor == 0:
            return np.zeros_like(state.x), np.zeros_like(state.x), np.zeros_like(state.x)
        speed = _WANDER * math.sqrt(2) * self.settings.turbulence
        turn = 2 * math.pi * spawns.turbulence_rate.take(ids) * state.age
        aside = speed * _sine(turn + spawns.turbulence_phase_x.take(ids))
        down = 0.5 * speed * _sine(turn + spawns.turbulence_phase_y.take(ids))
        own = factor * state.exposure * outside
        drift, fall = spawns.drift.take(ids) - 1, spawns.terminal_velocity.take(ids)
        right, along, towards = aside + drift * u, down + drift * v + fall, np.zeros_like(w)
        if self.has_depth:
            towards = speed * _sine(turn + spawns.turbulence_phase_z.take(ids)) + drift * w
        return own * right, own * along, own * towards

    def between(self, before: ParticleState, after: ParticleState, part: float) -> ParticleState:
        """Return the flakes at ``part`` (0..1) of a tick, without those that have cooled.

        Their velocity is that of their whole motion, relative to the frame.
        """
        age = before.age + part * TICK
        moved_x, moved_y, moved_z = after.x - before.x, after.y - before.y, after.z - before.z
        seen = self._with_sparks(
            replace(
                after,
                x=before.x + moved_x * part,
                y=before.y + moved_y * part,
                z=before.z + moved_z * part,
                vx=moved_x / TICK,
                vy=moved_y / TICK,
                vz=moved_z / TICK,
                age=age,
            )
        )
        return seen.where(age < self.spawns.life.take(before.id))

    def is_alive(self, state: ParticleState) -> NDArray[np.bool_]:
        """Return which flakes have neither cooled nor left the frame with their whole streak."""
        views, size = self.settings.views, self.spawns.size.take(state.id)
        if views:
            inside = np.any([self._is_seen(state, size, view) for view in views], axis=0)
        else:
            inside = self._is_inside(state, size, (self.settings.width, self.settings.height))
        return np.asarray((state.age < self.spawns.life.take(state.id)) & inside)

    def _is_seen(self, state: ParticleState, size: Column, view: FlakeView) -> NDArray[np.bool_]:
        """Return which flakes, of a ``size`` in px of the front, are in the frame of a view."""
        seen = view.seen(state)
        if view.camera.tiles:
            seen = replace(seen, x=np.mod(seen.x, view.camera.width))
        return self._is_inside(seen, size * view.magnification(seen.z), view.size)

    def _is_inside(
        self, state: ParticleState, margin: Column, size: tuple[int, int]
    ) -> NDArray[np.bool_]:
        """Return which flakes are in a frame of ``size``, px, or with a part of their streak."""
        if self.settings.streak > 0:
            margin = margin + np.hypot(state.vx, state.vy) * (self.settings.streak / 2)
        inside: NDArray[np.bool_] = (
            (state.x > -margin)
            & (state.x < size[0] + margin)
            & (state.y > -margin)
            & (state.y < size[1] + margin)
        )
        return inside


def _sine(angle: Column) -> NDArray[np.float32]:
    """Sine of angles, rad, in single precision: several times as fast, its errors invisible."""
    return np.sin(as_plane(angle))


def scattering_cosine(xi: NDArray[np.float64], k: float) -> NDArray[np.float64]:
    """cosθ = (2ξ + k − 1)/(2kξ − k + 1) of eq. 13, for uniform ξ in [0, 1).

    k = 0 scatters isotropically (cosθ uniform), k > 0 forward, k < 0 backward. At k = ±1, where
    the formula can be 0/0, its limit is taken: cosθ = ±1.
    """
    if abs(k) == 1.0:
        return np.full_like(xi, k)
    return np.clip((2 * xi + k - 1) / (2 * k * xi - k + 1), -1.0, 1.0)


def scatter_rotations(
    seed: int, tick: int, ids: NDArray[np.int64], k: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """cosθ and sinθ of the angle by which eq. 13 turns the velocity of each flake at ``tick``.

    θ's sign is random. It depends on (seed, tick, id) alone, not on which other flakes are alive.
    """
    if k == 1.0 or not len(ids):
        return np.ones(len(ids)), np.zeros(len(ids))
    # Draws are the same however many follow, so flakes with higher ids do not change them.
    count = min(int(ids.max()) + 1, _ANGLES)
    draws = 2 * generator(seed, RandomStream.SCATTER, tick).random(count).take(ids & (_ANGLES - 1))
    # One draw serves both: its upper half turns to the right, its lower half to the left.
    right = np.floor(draws)
    cos = scattering_cosine(draws - right, k)
    return cos, (2 * right - 1) * np.sqrt(1 - cos * cos)


def scatter_directions(seed: int, tick: int, ids: NDArray[np.int64]) -> Column:
    """Return the direction, rad, around its velocity, to which eq. 13 turns each flake at ``tick``;
    it depends on (seed, tick, id) alone."""
    count = min(int(ids.max(initial=-1)) + 1, _ANGLES)
    draws = generator(seed, RandomStream.SCATTER_IN_DEPTH, tick).random(count)
    return np.asarray(2 * math.pi * draws.take(ids & (_ANGLES - 1)))


def _scattered_in_depth(
    velocity: tuple[Column, Column, Column], cos: Column, sin: Column, turn: Column
) -> tuple[Column, Column, Column]:
    """Turn velocities (x, y, z) by an angle, given by its ``cos`` and ``sin``, to the direction
    ``turn``, rad, around them: 0 is in the plane of the frame, as in a flat clip."""
    x, y, z = velocity
    flat = np.hypot(x, y)
    unit = np.maximum(flat, 1e-12)
    aside = sin * np.cos(turn) * (np.hypot(flat, z) / unit)
    across = sin * np.sin(turn) / unit
    return (
        x * cos - y * aside - z * x * across,
        y * cos + x * aside - z * y * across,
        z * cos + flat * flat * across,
    )
