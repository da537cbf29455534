"""A small 3-D combustion simulation whose every burn closes into a seamless loop.

Stable fluids that carry two amounts.  *Fuel* (1 at a jet, 0 once burnt) burns down at a steady
rate and leaves *spent* gas, which is hot, lifts what it is in, and cools.  What feeds and stirs
the fire repeats with the loop; over its last frames the gas is led back to the states it had
before the first.

Units: pixels of a frame, and frames of time.  Positions count to the right from the middle, down
from the top, and away from the middle.  The grid is made of cubes, its velocities are cubes a
frame.  Fields are float32 arrays of shape ``(depth, height, width)``; a state of the gas has
another axis, of five channels: velocity to the right, down and away, fuel, spent gas.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from noise import Field, LoopNoise, LoopSeries
from scipy.fft import dstn, idstn

VELOCITY, FUEL, SPENT = slice(0, 3), 3, 4  #: channels of a state
CHANNELS = 5
MARGIN = 18  #: pixels at every border over which the gas comes to rest and goes out
SKIN = 4.0  #: pixels around a place that tell whether the flame is thin there


class Jet(NamedTuple):
    """A place where fuel comes out: a soft-edged ball, or flatter."""

    right: float
    down: float
    away: float
    radius: float
    strength: float = 1.0  #: fuel in its middle
    flat: float = 0.5  #: height in widths


@dataclass(frozen=True)
class Physics:
    """How gas burns and moves; lengths in pixels, times in frames."""

    life: float = 45.0  #: frames a parcel of fuel burns
    thinning: float = 1.0  #: how much faster thin flames burn out
    heating: float = 7.5  #: spent gas that comes of the fuel of a whole life
    cooling: float = 0.03  #: share of spent gas lost per frame, more where there is much
    lift: float = 0.5  #: upward acceleration of spent gas
    swelling: float = 0.3  #: growth of gas while it burns, over a life
    confinement: float = 0.3  #: vorticity confinement, for a cube of the grid
    sharpness: float = 0.35  #: share of the blur by looking up velocities that is undone, to .5
    drag: float = 0.01  #: share of the velocity lost per frame


@dataclass(frozen=True)
class Burner:
    """What burns, how it is stirred, and for how long; lengths in pixels, times in frames."""

    size: tuple[int, int, int]  #: depth, height, width of the room
    frames: int  #: length of the loop
    seed: int
    jets: Sequence[Jet]
    base: float  #: row of the jets: wind grows with the height above it
    physics: Physics = Physics()
    cell: float = 2.0  #: width of a cube of the grid
    pulse: float = 0.6  #: how far the supply of a jet varies
    speed: float = 4.0  #: at which fuel leaves a jet
    wander: float = 0.5  #: how far it turns aside
    ragged: float = 0.0  #: how far moving noise eats into the jets
    grain: tuple[float, float] = (8.0, 30.0)  #: wavelengths of that noise
    draught: float = 1.5  #: steady upward wind
    inflow: float = 0.01  #: air drawn in from the sides, and up with height, 1/frame
    gust: float = 0.0  #: swing of the side wind, per frame height above the base
    substeps: int = 2
    settling: int = 40  #: frames burnt before the one recorded
    closing: int = 24  #: frames in which the end is led to the start


class Room:
    """A grid of cubes and the gas in it: burns it, moves it, keeps its flow free of sources."""

    def __init__(self, size: tuple[int, int, int], cell: float, physics: Physics) -> None:
        self.cell, self.physics = np.float32(cell), physics
        self.shape = tuple(round(length / cell) for length in size)
        self.cubes = [axis.astype(np.float32) for axis in np.indices(self.shape, sparse=True)]
        self.away, self.down, self.right = (
            (axis + np.float32(0.5)) * self.cell - np.float32(origin)
            for axis, origin in zip(self.cubes, (size[0] / 2, 0, size[2] / 2), strict=True)
        )
        self.laplacian = open_laplacian(self.shape)
        self.calm = margin_window(self.shape, MARGIN / cell)

    def still(self) -> Field:
        """A state of gas at rest, without fuel."""
        return np.zeros((*self.shape, CHANNELS), np.float32)

    def positions(self, box: tuple[slice, ...]) -> list[Field]:
        """Positions (away, down, right) of the planes of a ``box``'s cubes, pixels."""
        axes = (self.away, self.down, self.right)
        return [np.ravel(axis)[part] for axis, part in zip(axes, box, strict=True)]

    def advance(self, state: Field, dt: float, wind: Sequence[Field]) -> Field:
        """The state ``dt`` frames later in a ``wind`` to the right, down and away."""
        physics, step = self.physics, np.float32(dt)
        state = self.carry(state, wind, step)
        burnt = self.burn(state, step)
        velocity = state[..., VELOCITY]
        velocity += step * self.swirl(velocity)
        velocity[..., 1] -= step * np.float32(physics.lift) / self.cell * state[..., SPENT]
        velocity *= (np.float32(1 - physics.drag * dt) * self.calm)[..., None]
        self.project(velocity, np.float32(physics.swelling) * burnt / step)
        return state

    def carry(self, state: Field, wind: Sequence[Field], dt: np.float32) -> Field:
        """``state`` carried by itself and the ``wind``: MacCormack's scheme, limited.

        The way back to where gas came from is traced with the velocity half way.
        """
        flow = state[..., VELOCITY].copy()
        for channel, share in enumerate(wind):
            flow[..., channel] += share
        half = dt / 2 * flow
        middle = dt * self.look_up(flow, -half)
        carried = self.look_up(state, -middle)
        blur = state - self.look_up(carried, middle)
        blur[..., VELOCITY] *= np.float32(self.physics.sharpness)
        blur[..., FUEL:] *= np.float32(0.5)
        low, high = (self.nearest(edge, -middle) for edge in neighbourhood(state))
        return np.clip(carried + blur, low, high)

    def cubes_at(self, offset: Field) -> list[Field]:
        """Cubes (away, down, right) at an ``offset`` (right, down, away), held in the grid."""
        return [
            np.clip(axis + offset[..., channel], 0, length - 1)
            for axis, channel, length in zip(self.cubes, (2, 1, 0), self.shape, strict=True)
        ]

    def look_up(self, values: Field, offset: Field) -> Field:
        """Trilinear values at ``offset`` from every cube: two flat look-ups, in one image.

        The image has the slices of the grid below one another.
        """
        depth, height, width = self.shape
        away, down, right = self.cubes_at(offset)
        slice_ = np.minimum(np.floor(away), depth - 2)
        rows, columns = (down + slice_ * height).reshape(-1, width), right.reshape(-1, width)
        image = values.reshape(depth * height, width, -1)
        near, far = (
            cv2.remap(image, columns, rows + np.float32(below), cv2.INTER_LINEAR)
            for below in (0, height)
        )
        share = (away - slice_).reshape(-1, width, 1)
        return np.asarray((near + share * (far - near)).reshape(values.shape), np.float32)

    def nearest(self, values: Field, offset: Field) -> Field:
        """Values of the cube nearest to ``offset`` from every cube."""
        depth, height, width = self.shape
        away, down, right = (np.rint(place) for place in self.cubes_at(offset))
        rows, columns = (down + away * height).reshape(-1, width), right.reshape(-1, width)
        image = values.reshape(depth * height, width, -1)
        found = cv2.remap(image, columns, rows, cv2.INTER_NEAREST)
        return np.asarray(found.reshape(values.shape), np.float32)

    def burn(self, state: Field, dt: np.float32) -> Field:
        """Turn fuel of ``state`` into spent gas, cool it, and return what burnt.

        Fuel burns at a steady rate, faster where the flame is thin and loses its heat.
        """
        physics, fuel, spent = self.physics, state[..., FUEL], state[..., SPENT]
        thin = np.clip(fuel - blurred(fuel, SKIN / float(self.cell)), 0, 1)
        loss = (1 + np.float32(physics.thinning) * thin) * dt / np.float32(physics.life)
        burnt = np.minimum(fuel, loss)
        fuel[...] = (fuel - burnt) * self.calm
        hot = spent + np.float32(physics.heating) * burnt
        hot *= 1 - np.float32(physics.cooling) * dt * (1 + hot * hot)
        spent[...] = np.clip(hot, 0, 1.5) * self.calm
        return np.asarray(burnt, np.float32)

    def swirl(self, velocity: Field) -> Field:
        """Vorticity confinement: the acceleration that gives eddies back what the grid smears."""
        right, down, away = (gradient(velocity[..., channel]) for channel in range(3))
        spin = np.stack([away[1] - down[2], right[2] - away[0], down[0] - right[1]], axis=-1)
        slope = np.stack(gradient(np.sqrt((spin * spin).sum(axis=-1))), axis=-1)
        size = np.sqrt((slope * slope).sum(axis=-1, keepdims=True)) + np.float32(1e-4)
        slope *= np.float32(self.physics.confinement) / size
        return np.asarray(np.cross(slope, spin), np.float32)

    def project(self, velocity: Field, swelling: Field) -> None:
        """Remove the divergence of ``velocity`` except for ``swelling``, in place."""
        divergence = sum(gradient(velocity[..., axis])[axis] for axis in range(3)) - swelling
        pressure = idstn(dstn(divergence, type=1) / self.laplacian, type=1)
        velocity -= np.stack(gradient(pressure.astype(np.float32)), axis=-1)


def gradient(values: Field) -> list[Field]:
    """Slopes of ``values`` to the right, down and away, per cube."""
    return [np.asarray(slope) for slope in np.gradient(values)][::-1]


def blurred(values: Field, radius: float) -> Field:
    """``values`` under a Gaussian of ``radius`` cubes."""
    depth = len(values)
    flat = np.stack([cv2.GaussianBlur(part, (0, 0), radius) for part in values])
    reach = 2 * int(3 * radius) + 1
    deep = cv2.GaussianBlur(flat.reshape(depth, -1), (1, reach), sigmaX=1, sigmaY=radius)
    return np.asarray(deep.reshape(values.shape), np.float32)


def neighbourhood(state: Field) -> tuple[Field, Field]:
    """The least and the greatest of each cube and its neighbours."""
    depth, height, width, channels = state.shape
    image, box = state.reshape(depth * height, width, channels), np.ones((3, 3), np.uint8)
    found: list[Field] = []
    for flat, pick in ((cv2.erode, np.minimum), (cv2.dilate, np.maximum)):
        within = np.asarray(flat(image, box).reshape(state.shape), np.float32)
        across = within.copy()
        pick(across[1:], within[:-1], out=across[1:])
        pick(across[:-1], within[1:], out=across[:-1])
        found.append(across)
    return found[0], found[1]


def margin_window(shape: Sequence[int], margin: float) -> Field:
    """1 inside, falling smoothly to 0 over ``margin`` cubes at every border."""
    window = np.ones(shape, np.float32)
    for axis in np.indices(shape, sparse=True):
        t = np.clip((np.minimum(axis, axis.max() - axis) + 0.5) / margin, 0, 1)
        window *= (t * t * (3 - 2 * t)).astype(np.float32)
    return window


def open_laplacian(shape: Sequence[int]) -> Field:
    """Eigenvalues of the Laplacian of nearest neighbours; pressure is zero outside.

    Air may cross every border.
    """
    lines = [2 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1)) - 2 for n in shape]
    return np.asarray(sum(np.ix_(*lines)), dtype=np.float32)


class Furnace:
    """A burner in its room, with everything that feeds and stirs it."""

    def __init__(self, burner: Burner) -> None:
        self.burner, self.room = burner, Room(burner.size, burner.cell, burner.physics)
        rng = np.random.Generator(np.random.Philox(burner.seed))
        count, period = len(burner.jets), burner.frames
        self.supply = LoopSeries.draw(rng, count, period, 7)
        self.aside = LoopSeries.draw(rng, 2 * count, period, 5)
        self.breeze = LoopSeries.draw(rng, 1, period, 3)
        self.noise = LoopNoise.draw(rng, burner.grain, period, burner.speed, axes=3)
        self.heights = np.clip(burner.base - self.room.down, 0, None)
        self.beds = [self.bed(jet) for jet in burner.jets]

    def bed(self, jet: Jet) -> tuple[tuple[slice, ...], Field]:
        """Where a jet is, and its fuel there at full supply."""
        room = self.room
        reach = [
            (room.away - jet.away) / jet.radius,
            (room.down - jet.down) / (jet.flat * jet.radius),
            (room.right - jet.right) / jet.radius,
        ]
        inside = np.clip(1 - np.sqrt(sum(r * r for r in reach)), 0, 1)
        box = tuple(slice(places.min(), places.max() + 1) for places in np.nonzero(inside))
        fuel = inside[box] * (2 - inside[box]) * np.float32(jet.strength)
        return box, fuel.astype(np.float32)

    def wind(self, time: float) -> list[Field]:
        """Air drawn in from all sides and up, and a side wind that swings with the loop."""
        burner, room = self.burner, self.room
        side = burner.gust * self.breeze(time)[0] * (self.heights / burner.size[1]) ** 0.7
        right = side - burner.inflow * room.right
        down = -burner.draught - 2 * burner.inflow * self.heights
        away = -burner.inflow * room.away
        return [np.asarray(way / room.cell, np.float32) for way in (right, down, away)]

    def feed(self, state: Field, time: float, dt: float) -> None:
        """Renew fuel and speed of ``state`` at the jets, which swell and starve and turn."""
        burner, room = self.burner, self.room
        supply = np.clip(0.5 + burner.pulse * self.supply(time), 0.02, 1.2)
        aside = self.aside(time).reshape(2, -1)
        for number, (box, full) in enumerate(self.beds):
            share = supply[number]
            if burner.ragged:
                bite = np.clip(0.5 + 0.5 * self.noise.sample(room.positions(box), time), 0, 1.5)
                full = np.clip(full - np.float32(burner.ragged) * bite, 0, 1)
            fuel = np.clip(full * share * (2 - full), 0, 1)
            gas = state[box]
            gas[..., FUEL] = np.maximum(gas[..., FUEL], fuel)
            gas[..., SPENT] = np.maximum(gas[..., SPENT], 0.4 * fuel)
            turned = burner.wander * aside[:, number]
            leaving = np.array([turned[0], -1, turned[1]], np.float32)
            leaving *= np.float32(burner.speed) * share / room.cell
            mix = (np.float32(0.5 * dt) * np.minimum(full, 1))[..., None]
            gas[..., VELOCITY] += mix * (leaving - gas[..., VELOCITY])


def burn_loop(burner: Burner) -> Iterator[Field]:
    """Fuel in each frame of a loop of ``burner.frames`` frames, (depth, height, width)."""
    furnace = Furnace(burner)
    room, state = furnace.room, furnace.room.still()
    before: dict[int, Field] = {}
    dt = 1 / burner.substeps
    for frame in range(-burner.settling, burner.frames):
        if -burner.closing <= frame < 0:
            before[frame + burner.frames] = state.copy()
        if frame in before:  # an equal part of the way in each of the frames left
            state += (before.pop(frame) - state) / np.float32(burner.frames - frame)
        if frame >= 0:
            yield state[..., FUEL]
        for part in range(burner.substeps):
            time = frame + part * dt
            furnace.feed(state, time, dt)
            state = room.advance(state, dt, furnace.wind(time))
