"""Synthesise looping fire textures: fuel that burns down while a periodic flow carries it up.

The flow is not simulated but composed of three parts: gas that accelerates as it rises, air drawn
in towards the middle, and eddies that rise more slowly than the gas. It repeats after N images, and
all fuel burns out sooner, so the images loop. Fuel burns down at a constant rate; a tongue of flame
ends where none is left, so its tip is sharp.

Units: sheet heights and images; u to the right, 0 in the middle of the sheet; v up from its base.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.easing import saturated, smooth_step
from fire_atlas.core.noise import PlaneWaves, curl_differences, random_wave_vectors
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.generators.silk.fuel import Burner
from fire_atlas.generators.silk.texture_loop import TextureLoop, edge_fade
from fire_atlas.vision.warp import sample_at

_EDDIES = 48
"""Number of waves summed for the eddies."""

_WAVELENGTHS = (0.07, 0.5)
"""Shortest and longest eddy, sheet heights."""

_EDDY_RISE = 0.62
"""Speed at which eddies rise, relative to the gas."""

_SUPPLY_WAVES = 12
"""Number of waves summed for the variation of the fuel along the burner."""

INLET_HEIGHT = 0.07
"""Height of the fuel inlet in its middle, sheet heights."""

_INLET_CURVE, _INLET_DEPTH, _INLET_DEPTH_BELOW = 0.10, 0.035, 0.042
"""Additional height of the inlet at its sides, and distances over which it fades above and below,
sheet heights."""

_INLET_REACH = 4.5
"""Height above the inlet, depths, from which on less than 2e-9 of the fuel enters."""

_LONGEST_WAY = 0.45
"""Maximum distance that the gas goes in a time step, inlet depths. With half of it, flames are as
high within 5 %."""

_FILLING = 0.021
"""Distance that the gas goes while an inlet without fuel fills to ``_FILLED``, sheet heights."""

_FILLED = 0.88
"""Part of the supply that the middle of the inlet holds after that distance."""

_GRAIN_HEIGHT = 0.16
"""Height between fine puffs of fuel at the inlet, sheet heights."""

_MIXING_RADIUS = 0.016
"""Distance over which air mixes into the flame, sheet heights."""

_GAP, _CLOSING = 0.022, 6.0
"""Reach to either side across which fire closes a gap in it, and how fast: the part of what is
lacking per sheet height that the gas rises, sheet heights."""

_COOL_HEIGHT = 0.22
"""Height up to which gas is still so cool that the foot of a flame is dim, sheet heights."""

_MOTION_CELL = 2
"""Texture pixels per cell of the recorded motion, which is smooth."""


@dataclass(frozen=True, slots=True)
class _Supply:
    """Random variations along the burner, each with an rms of 1.

    Attributes:
        tongues: Slow and wide variation of the fuel, which parts the tongues of the flame.
        grain: Fast and fine variation of the fuel.
        feet: Slow variation of the height at which flames begin.
    """

    tongues: PlaneWaves
    grain: PlaneWaves
    feet: PlaneWaves


def synthesise_texture(
    burner: Burner,
    images: int,
    shape: tuple[int, int],
    aspect: float,
    seed: int,
    index: int,
    fineness: int = 1,
) -> TextureLoop:
    """Synthesise a loop of images of fire.

    Args:
        burner: Constants of the fire.
        images: N, the number of images in the loop.
        shape: (height, width) of an image, px.
        aspect: Width of the sheet, sheet heights.
        seed: Seed of the recipe.
        index: Number of the texture; each number gives a different fire.
        fineness: How many times more time steps are done than needed.

    Returns:
        A loop with one channel: heat, 0..1.25, and 0 at every edge.
    """
    height, width = shape
    v = 1 - (np.arange(height) + 0.5) / height
    u = ((np.arange(width) + 0.5) / width - 0.5) * aspect
    chance = generator(seed, RandomStream.PLUME, index)
    flow = _GasFlow(burner, _random_eddies(chance, burner, images), u, v)
    steps = math.ceil(burner.gas_speed / (_LONGEST_WAY * _INLET_DEPTH)) * fineness
    way = burner.gas_speed / steps
    inlet = _FuelInlet(burner, _random_supply(chance, burner, images), u, v, aspect, way)
    advection = _Advection(shape, inlet.distance(), height / steps)
    burnt = np.float32(way / burner.flame_height)
    fuel = np.zeros(shape, np.float32)
    heat = np.empty((images, height, width), np.float32)
    motion = np.empty((images, *advection.coarse_shape, 2), np.float32)
    warm_up = int(2.2 * burner.flame_height / burner.gas_speed) + 1
    for step in range(-warm_up * steps, images * steps):
        n, part = divmod(step, steps)
        right, up = flow.velocity(step / steps)
        if n >= 0:
            if part == 0:
                heat[n] = fuel
                advection.restart()
            advection.follow(right, up)
            if part == steps - 1:
                motion[n] = advection.displacement()
        fuel = _with_gaps_closed(advection.advect(fuel, right, up), way)
        fuel = _consume(fuel, burnt, burner.mixing, height)
        fuel = inlet.replenish(fuel, step / steps)
    warm = burner.foot_heat + (1 - burner.foot_heat) * smooth_step(v / _COOL_HEIGHT)
    heat = np.clip(heat, 0.0, 1.25) * edge_fade(shape) * as_plane(warm)[:, None]
    return TextureLoop(heat[..., None], motion)


def _with_gaps_closed(fuel: Plane, way: float) -> Plane:
    """Return ``fuel`` after the gas has risen by ``way``, with narrow gaps between fire filled as
    far as the less of both sides."""
    reach = max(1, round(_GAP * len(fuel)))
    beside = as_plane(cv2.copyMakeBorder(fuel, 0, 0, reach, reach, cv2.BORDER_CONSTANT))
    less = np.minimum(beside[:, : -2 * reach], beside[:, 2 * reach :])
    part = np.float32(-math.expm1(-_CLOSING * way))
    return as_plane(fuel + part * np.maximum(less - fuel, 0.0))


def _consume(fuel: Plane, burnt: np.float32, mixing: float, height: int) -> Plane:
    """Return ``fuel`` after it has burnt down by ``burnt``.

    Where air is near it burns faster, by up to ``mixing`` times as much: so tongues taper to points
    and thin threads of fuel do not last.
    """
    around = cv2.GaussianBlur(fuel, (0, 0), _MIXING_RADIUS * height)
    air = np.clip(1 - around / np.maximum(fuel, np.float32(1e-3)), 0, 1)
    return as_plane(np.maximum(fuel - burnt * (1 + np.float32(mixing) * air), 0.0))


class _FuelInlet:
    """Inlet of the fuel: a ragged strip at the foot, supplied unevenly along its width."""

    def __init__(
        self,
        burner: Burner,
        supply: _Supply,
        u: NDArray[np.float64],
        v: NDArray[np.float64],
        aspect: float,
        way: float,
    ) -> None:
        """Prepare for images of u by v: ``way`` is how far gas goes in a time step."""
        # What is still lacking falls by the same factor over the same way of the gas.
        self._filling = np.float32(math.log(1 - _FILLED) * way / _FILLING)
        across = np.abs(u) / (aspect * burner.width / 2)
        # The inlet is higher at the sides of the burner, where ``across`` is 1.
        inlet = INLET_HEIGHT + _INLET_CURVE * np.minimum(across, 1.2)[None] ** 2
        self._above = as_plane(v[:, None] - inlet)
        highest = _INLET_REACH * _INLET_DEPTH + burner.ragged * np.abs(supply.feet.amplitude).sum()
        self._supplied = slice(int(np.argmax(self._above.min(axis=1) < highest)), len(v))
        self._profile = np.clip(1 - across**2, 0, None) ** 0.75
        waves = supply.tongues, supply.grain, supply.feet
        self._supply = tuple(wave.on_grid(u, np.zeros(1)) for wave in waves)
        self._burner = burner

    def replenish(self, fuel: Plane, time: float) -> Plane:
        """Add the fuel that enters at ``time`` to ``fuel``, in place, and return it."""
        burner = self._burner
        tongues, grain, feet = (waves.values(time) for waves in self._supply)
        supply = self._profile * np.clip(1 + burner.flicker * tongues, 0, 1.3)
        supply = as_plane(supply * np.clip(1 + burner.grain * grain, 0, 1.4))
        above = self._above[self._supplied] - np.float32(burner.ragged) * feet
        depth = np.where(above > 0, np.float32(_INLET_DEPTH), np.float32(_INLET_DEPTH_BELOW))
        mask = saturated(-self._filling * np.exp(-((above / depth) ** 2)))
        near = fuel[self._supplied]
        near += np.maximum(supply - near, 0.0) * mask
        return fuel

    def distance(self) -> Plane:
        """Return each pixel's distance from the inlet: 0 at it or below, 1 three depths above."""
        return as_plane(np.clip(self._above / (3 * _INLET_DEPTH), 0.0, 1.0))


class _Advection:
    """Advects images along a flow, and tracks how far pixels move between images."""

    def __init__(self, shape: tuple[int, int], weight: Plane, px: float) -> None:
        """Prepare for images of ``shape``: ``weight`` scales the displacement of each pixel, ``px``
        is the number of pixels that a velocity of 1 covers in a time step."""
        height, width = shape
        columns, rows = np.meshgrid(np.arange(width), np.arange(height))
        self._columns, self._rows = as_plane(columns), as_plane(rows)
        self._weight, self._px = weight, np.float32(px)
        self._x, self._y = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        self.coarse_shape = -(-height // _MOTION_CELL), -(-width // _MOTION_CELL)

    def restart(self) -> None:
        """Start to track all pixels from their own positions."""
        self._x[:], self._y[:] = 0, 0

    def follow(self, right: Plane, up: Plane) -> None:
        """Move the tracked points by a time step of the flow."""
        at = self._columns + self._x, self._rows + self._y
        edge = cv2.BORDER_REPLICATE
        self._x += sample_at(right, *at, border=edge) * self._px
        self._y -= sample_at(up, *at, border=edge) * self._px

    def displacement(self) -> NDArray[np.float32]:
        """Return the displacement of the tracked points, px, on a coarser grid (h, w, 2)."""
        size = self.coarse_shape[1], self.coarse_shape[0]
        coarse = [
            cv2.resize(moved * self._weight, size, interpolation=cv2.INTER_AREA)
            for moved in (self._x, self._y)
        ]
        return as_plane(np.dstack(coarse))

    def advect(self, fuel: Plane, right: Plane, up: Plane) -> Plane:
        """Return ``fuel`` after a time step of the flow.

        Semi-Lagrangian: what bilinear sampling blurs, there and back, is added beforehand (BFECC,
        Dupont & Liu 2003). A cubic kernel would sharpen in every step, so that shorter steps made
        other flames.
        """
        right, up = right * self._px, up * self._px
        before = self._columns - right, self._rows + up
        after = self._columns + right, self._rows - up
        there = sample_at(fuel, *before, border=cv2.BORDER_CONSTANT)
        back = sample_at(there, *after, border=cv2.BORDER_CONSTANT)
        corrected = fuel + np.float32(0.5) * (fuel - back)
        return sample_at(corrected, *before, border=cv2.BORDER_CONSTANT)


class _GasFlow:
    """Velocity of the gas, sheet heights per image: a steady flow plus eddies."""

    def __init__(
        self, burner: Burner, eddies: PlaneWaves, u: NDArray[np.float64], v: NDArray[np.float64]
    ) -> None:
        self._eddies = eddies.on_grid(u, v)
        gas, spacing = burner.gas_speed, v[0] - v[1]
        # Eddies grow with height: a flame is smooth at its foot.
        self._growth = as_plane(np.clip(1.7 * v + 0.08, 0.0, 1.0)[:, None])
        self._gain = np.float32(burner.eddy_strength * gas / (2 * spacing))
        speed = gas * (0.4 + 0.85 * np.sqrt(v))
        self._up = as_plane(np.repeat(speed[:, None], len(u), axis=1))
        inward = burner.entrainment * gas * np.clip(1.2 - np.abs(v - 0.25), 0.3, 1.0)
        if burner.widening_height > 0:
            above = (v - burner.widening_height) / (0.5 * burner.widening_height)
            inward *= np.clip(above, -1.4, 1.0)
        self._right = as_plane(-u[None] * inward[:, None])

    def velocity(self, time: float) -> tuple[Plane, Plane]:
        """Return the velocity at ``time``: (right, up), each (height, width)."""
        stream = self._eddies.values(time) * self._growth
        right, up = curl_differences(stream)
        return right * self._gain + self._right, up * self._gain + self._up


def _random_eddies(chance: np.random.Generator, burner: Burner, images: int) -> PlaneWaves:
    """Return a random stream function of eddies whose velocity has an rms of 1."""
    length, ku, kv = random_wave_vectors(chance, _EDDIES, _WAVELENGTHS)
    relative = chance.normal(0, 0.8, _EDDIES) * burner.gas_speed / length
    amplitude = length**1.45
    amplitude /= np.sqrt(((amplitude * (2 * np.pi / length)) ** 2).sum() / 2)
    omega = _periodic(relative - kv * _EDDY_RISE * burner.gas_speed, images)
    return PlaneWaves(ku, kv, omega, chance.uniform(0, 2 * np.pi, _EDDIES), amplitude)


def _random_supply(chance: np.random.Generator, burner: Burner, images: int) -> _Supply:
    """Return how the fuel varies along the burner and with time."""
    width, slow = burner.tongue_width, 0.8 * burner.gas_speed / burner.flame_height
    tongues = _random_line(chance, (0.7 * width, 4 * width), slow, images)
    # The gas carries what varies quickly upwards: as streaks, and tips that come off.
    fast = burner.gas_speed / _GRAIN_HEIGHT
    grain = _random_line(chance, (0.2 * width, 0.9 * width), fast, images)
    return _Supply(tongues, grain, _random_line(chance, (0.4 * width, 2 * width), slow, images))


def _random_line(
    chance: np.random.Generator, lengths: tuple[float, float], rate: float, images: int
) -> PlaneWaves:
    """Return waves along a line, of wavelengths in the range ``lengths``, with an rms of 1, whose
    frequencies spread by ``rate``, per image."""
    shortest, longest = np.log(lengths)
    length = np.exp(chance.uniform(shortest, longest, _SUPPLY_WAVES))
    omega = chance.normal(0, 1.0, _SUPPLY_WAVES) * 2 * np.pi * rate
    return PlaneWaves(
        2 * np.pi / length * chance.choice([-1.0, 1.0], _SUPPLY_WAVES),
        np.zeros(_SUPPLY_WAVES),
        _periodic(omega, images),
        chance.uniform(0, 2 * np.pi, _SUPPLY_WAVES),
        np.full(_SUPPLY_WAVES, np.sqrt(2 / _SUPPLY_WAVES)),
    )


def _periodic(omega: NDArray[np.float64], images: int) -> NDArray[np.float64]:
    """Round angular frequencies to the nearest that are periodic in ``images``."""
    fundamental = 2 * np.pi / images
    return np.rint(omega / fundamental) * fundamental
