"""Record a simulation: the gas of every frame, as a loop without a seam or as a fire that ends."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.combustion import FUEL, SMOKE
from fire_atlas.generators.fluid.grid import Field
from fire_atlas.generators.fluid.scene import Scene
from fire_atlas.generators.fluid.simulation import simulated
from fire_atlas.generators.fluid.volume import Volume

_REPEATS = 0.25
"""Difference of frames a period apart, of that of neighbours, up to which a fire repeats by
itself: its seam is at most that much longer than another step."""

_EMPTY = 0.02
"""Smoke, of the densest, up to which a cube counts as empty."""


@dataclass(frozen=True, slots=True)
class FluidRecording:
    """A fire that was simulated.

    Attributes:
        volumes: The gas of each frame.
        repeats: Difference of frames a period apart, of that of neighbours, before the end was led
            to the beginning; None of a fire that plays once.
    """

    volumes: tuple[Volume, ...]
    repeats: float | None

    @property
    def is_led(self) -> bool:
        """Whether its end was led to its beginning."""
        return self.repeats is not None and self.repeats > _REPEATS


def record(
    scene: Scene, workers: Workers, count: Callable[[], None] = lambda: None
) -> FluidRecording:
    """Simulate a scene and record it; ``count`` is called after each frame."""
    frames = simulated(scene, workers, count)
    before = [Volume.of(next(frames)) for _ in range(scene.overlap)]
    volumes = []
    for number, scalars in enumerate(frames):
        presence = scene.presence(number)
        volumes.append(Volume.of(scalars if presence >= 1 else _thinned(scalars, presence)))
    if not before:
        return FluidRecording(tuple(volumes), None)
    repeats = _difference(before, volumes)
    if repeats > _REPEATS:
        for k in range(1, len(before) + 1):
            # Smooth in time, so that the step over the seam is one as any other.
            share = smooth_step(np.array((len(before) + 1 - k) / (len(before) + 1), np.float32))
            after = volumes[-k].scalars()
            volumes[-k] = Volume.of(after + share * (before[-k].scalars() - after))
    return FluidRecording(tuple(volumes), repeats)


def _thinned(scalars: Field, presence: float) -> Field:
    """Return gas of which a part ``presence`` is left, 0..1: smoke in so many of its cubes, so that
    it is torn before it is gone; what is as dense everywhere goes at once."""
    left, smoke = scalars * np.float32(presence), scalars[..., SMOKE]
    if (densest := smoke.max()) > 0:
        worn = np.quantile(smoke[smoke > _EMPTY * densest], 1 - presence)
        left[..., SMOKE] = np.maximum(smoke - np.float32(worn), 0)
    return left


def _difference(before: list[Volume], volumes: list[Volume]) -> float:
    """Return how different frames a period apart are, relative to neighbours."""
    apart, step = 0.0, 0.0
    for k in range(1, len(before) + 1):
        seen = _visible(volumes[-k].scalars())
        apart += float(np.abs(seen - _visible(before[-k].scalars())).mean(dtype=np.float64))
        neighbour = volumes[-k - 1 if k < len(volumes) else -k]
        step += float(np.abs(seen - _visible(neighbour.scalars())).mean(dtype=np.float64))
    return apart / max(step, 1e-12)


def _visible(scalars: Field) -> Field:
    return scalars[..., FUEL] + scalars[..., SMOKE]
