"""Record a simulation: the gas of every frame, as a loop without a seam or as a fire that ends."""

from collections.abc import Callable

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


def record(
    scene: Scene,
    workers: Workers,
    keep: Callable[[Volume], None],
    count: Callable[[], None] = lambda: None,
) -> float | None:
    """Simulate a scene, and record it.

    Args:
        scene: The scene.
        workers: Threads that simulate.
        keep: Called with the gas of each frame, in order, as soon as it stays as it is: the end of
            a loop may be led to its beginning.
        count: Called after each frame that is simulated.

    Returns:
        The difference of frames a period apart, of that of neighbours, before the end was led to
        the beginning; None of a fire that plays once.

    Raises:
        RecipeError: A field is not finite any more.
    """
    frames = simulated(scene, workers, count)
    before = [Volume.of(next(frames)) for _ in range(scene.overlap)]
    # One frame more than may be led: the step to it is compared.
    free = scene.frames - len(before) - 1 if before else scene.frames
    ending: list[Volume] = []
    for number, scalars in enumerate(frames):
        presence = scene.presence(number)
        left = scalars if presence >= 1 else _thinned(scalars, presence)
        volume = Volume.of(left)
        if number < free:
            keep(volume)
        else:
            ending.append(volume)
    if not before:
        return None
    repeats = _difference(before, ending, workers)
    leads = is_led(repeats)

    def led(k: int) -> Volume:
        """Return one of the last frames as it is kept; it is ``k`` frames after ``before[0]``."""
        volume = ending[k - len(before)]
        if not leads:
            return volume
        # Smooth in time, so that the step over the seam is one as any other.
        share = smooth_step(np.array((k + 1) / (len(before) + 1), np.float32))
        after = volume.scalars()
        return Volume.of(after + share * (before[k].scalars() - after))

    for volume in [*ending[: -len(before)], *workers.map(led, range(len(before)))]:
        keep(volume)
    return repeats


def is_led(repeats: float | None) -> bool:
    """Whether the end of a fire is led to its beginning, by what ``record`` returns."""
    return repeats is not None and repeats > _REPEATS


def _thinned(scalars: Field, presence: float) -> Field:
    """Return gas of which a part ``presence`` is left, 0..1: smoke in so many of its cubes, so that
    it is torn before it is gone; what is as dense everywhere goes at once."""
    left, smoke = scalars * np.float32(presence), scalars[..., SMOKE]
    if (densest := smoke.max()) > 0:
        worn = np.quantile(smoke[smoke > _EMPTY * densest], 1 - presence)
        left[..., SMOKE] = np.maximum(smoke - np.float32(worn), 0)
    return left


def _difference(before: list[Volume], ending: list[Volume], workers: Workers) -> float:
    """Return how different frames a period apart are, relative to neighbours."""

    def compared(k: int) -> tuple[float, float]:
        seen = _visible(ending[-k])
        others = before[-k], ending[-k - 1 if k < len(ending) else -k]
        apart, step = (
            float(np.abs(seen - _visible(other)).mean(dtype=np.float64)) for other in others
        )
        return apart, step

    found = list(workers.map(compared, range(1, len(before) + 1)))
    return sum(apart for apart, _ in found) / max(sum(step for _, step in found), 1e-12)


def _visible(volume: Volume) -> Field:
    scalars = volume.scalars()
    return scalars[..., FUEL] + scalars[..., SMOKE]
