"""Simulate a fire frame by frame, and keep its gas."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.workers import Workers
from fire_atlas.effect.field.wind import LEVEL_SPEED, wind_velocity
from fire_atlas.generators.fluid.advection import Carried, mac_cormack
from fire_atlas.generators.fluid.burners import Feed
from fire_atlas.generators.fluid.combustion import burn, smoothed
from fire_atlas.generators.fluid.forces import push
from fire_atlas.generators.fluid.grid import Field, FluidGrid
from fire_atlas.generators.fluid.noise import Stirring
from fire_atlas.generators.fluid.projection import Projection
from fire_atlas.generators.fluid.scene import Scene

_FARTHEST = 4.5
"""Distance, cubes, that gas may be carried in a time step; thin flames show combs beyond it."""

MOST_THREADS = 8
"""Most threads that simulate: each works on a slab of its own, which takes memory."""

_STEPS = (2, 8)
"""Fewest and most time steps of a frame."""

_SHARPNESS = Carried(
    np.array([0.35, 0.35, 0.35, 0], np.float32), np.array([0.5, 0.5, 0.5, 0], np.float32)
)
"""Part of the blur of look-ups that is undone. Of velocity less than the scheme's half: what it
adds to eddies, vorticity confinement adds already."""

_FADE = 0.06
"""Width, heights, of the border of the box in which fuel, heat and smoke fade."""

_SHELTER = 0.12
"""Height up to which the wind grows over the ground, heights."""


@dataclass(slots=True)
class Gas:
    """The state of the gas: what a step changes.

    Attributes:
        velocity: (layers, rows, columns, 4): right, down and away, heights/s.
        scalars: (layers, rows, columns, 4): fuel, temperature, smoke.
    """

    velocity: Field
    scalars: Field


class Simulation:
    """A fire that burns: its gas, and all that feeds and moves it."""

    def __init__(self, scene: Scene, workers: Workers) -> None:
        """Begin with still air."""
        self.scene, self.grid, self._workers = scene, scene.grid, workers
        self.gas = Gas(self.grid.zeros(4), self.grid.zeros(4))
        self.time = -scene.settling / scene.fps
        self._projection = Projection.of(self.grid)
        self._stirring = Stirring.of(
            self.grid, scene.period, generator(scene.seed, RandomStream.STIRRING)
        )
        self._feeds = [
            Feed.of(burner, self.grid, scene.period, scene.seed, number)
            for number, burner in enumerate(scene.burners)
        ]
        self._fading = border_fading(self.grid, scene.thinning)

    def frame(self) -> int:
        """Simulate the time of one frame, and return how many steps it took.

        Raises:
            RecipeError: A field is not finite any more.
        """
        left, end, steps = 1 / self.scene.fps, self.time + 1 / self.scene.fps, 0
        while left > 1e-9:
            fastest = max(float(self.gas.velocity.max()), -float(self.gas.velocity.min()))
            if not math.isfinite(fastest):
                raise RecipeError(
                    f"the gas of frame {max(0, round(self.time * self.scene.fps))} moved so fast "
                    "that its simulation broke; use less lift, speed or blast",
                    key=("source",),
                )
            fewest = fastest * left / (_FARTHEST * self.grid.cell)
            share = math.ceil(_STEPS[0] * left * self.scene.fps - 1e-6)
            dt = left / min(max(math.ceil(fewest), share), max(1, _STEPS[1] - steps))
            self.step(dt)
            self.time, left, steps = self.time + dt, left - dt, steps + 1
        self.time = end
        return steps

    def step(self, dt: float) -> None:
        """Simulate ``dt`` s."""
        grid, scene, workers = self.grid, self.scene, self._workers
        velocity, scalars = self.gas.velocity, self.gas.scalars
        for feed in self._feeds:
            feed.add(velocity, scalars, self.time, dt)
        wind = self._wind()
        velocity, scalars = mac_cormack(
            grid, Carried(velocity, scalars), wind, dt, _SHARPNESS, workers
        )
        burnt, temperature = burn(grid, scalars, scene.chemistry, self._fading, dt, workers)
        push(grid, velocity, temperature, scene.forces, self._stirring, self.time, dt, workers)
        source, expansion = grid.empty(), np.float32(scene.expansion(self.time) / dt)

        def expand(part: slice) -> None:
            # One that changed from cube to cube would be a flow that differences hardly see.
            source[part] = smoothed(burnt, part) * expansion

        grid.each_part(workers, expand)
        self._projection.project(velocity, source, workers)
        self.gas = Gas(velocity, scalars)

    def _wind(self) -> Field:
        """Return the velocity of the air that blows, (rows, 4)."""
        scene = self.scene
        time = self.time % scene.period if scene.loop else max(0.0, self.time)
        right, away = wind_velocity(scene.wind, time)
        blown = np.zeros((self.grid.shape[1], 4), np.float32)
        height = np.clip(self.grid.up[0, :, 0] / _SHELTER, 0, 1)
        for channel, speed in ((0, right), (2, away)):
            blown[:, channel] = height * (2 - height) * np.float32(speed * LEVEL_SPEED)
        return blown


def border_fading(grid: FluidGrid, top: float) -> Field:
    """Return 1 inside, falling smoothly to 0 at every open border of a grid, over ``top`` heights
    more at its upper one."""
    fading = np.ones(grid.shape, np.float32)
    width = _FADE / grid.cell
    for axis, length in enumerate(grid.shape):
        place = np.arange(length) + 0.5
        first, last = place / width, (length - place) / width
        if axis == 1:
            first = place / (width + top / grid.cell)
            last = last if not grid.has_ground else np.ones_like(last)
        smooth = smooth_step(np.minimum(first, last)).astype(np.float32)
        fading *= smooth.reshape([-1 if k == axis else 1 for k in range(3)])
    return fading


def simulated(scene: Scene, workers: Workers, count: Callable[[], None]) -> Iterator[Field]:
    """Yield the scalars (layers, rows, columns, 4) of every frame, those of ``scene.overlap``
    frames before the first one too; ``count`` is called after each that is simulated."""
    simulation = Simulation(scene, workers)
    for number in range(-scene.settling, scene.frames):
        if number >= -scene.overlap:
            yield simulation.gas.scalars
        if number < scene.frames - 1:
            simulation.frame()
        count()
