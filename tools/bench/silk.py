"""Silk: springs against a plain loop, frames a second, and what sheets and pixels cost.

Run: ``python -m tools.bench.silk`` in the checkout. CPU seconds of one core, but where it says two.
"""

import math
import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from fire_atlas.core.workers import Workers
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.generators.silk.mechanics import (
    Elasticity,
    SheetModel,
    SheetPlacement,
    SheetState,
    StepLimit,
    Vectors,
    build_model,
    spring_force,
    step,
)
from fire_atlas.generators.silk.renderer import SilkRenderer, generate_silk, silk_camera
from fire_atlas.recipe.silk import SilkSource
from fire_atlas.recipe.source import Views
from fire_atlas.recipe.wind import Wind


def cpu(work: Callable[[], object], times: int = 3) -> float:
    """Least CPU seconds of ``work``."""
    least = math.inf
    for _ in range(times):
        start = time.process_time()
        work()
        least = min(least, time.process_time() - start)
    return least


def model_of(sheets: int, rows: int = 24, columns: int = 16) -> SheetModel:
    places = [SheetPlacement((0.0, 0.0, 0.0), 0.4, 0.8, 180.0 * n / sheets) for n in range(sheets)]
    return build_model(places, rows, columns, [Elasticity(0.3, 8.0, 3.0, 1.0, 1.0)] * sheets)


def plain_force(model: SheetModel, x: list[Any], v: list[Any]) -> list[Any]:
    """The same forces, spring by spring, in plain Python."""
    sheets, rows, columns = model.rest.shape[:3]
    force = [[[[0.0] * 3 for _ in range(columns)] for _ in range(rows)] for _ in range(sheets)]
    for springs in model.springs:
        rest = springs.rest.tolist()
        shift = max(-springs.right, 0)
        for s in range(sheets):
            for r, along in enumerate(rest[s]):
                for c, length in enumerate(along):
                    one, other = (r, c + shift), (r + springs.down, c + shift + springs.right)
                    a, b = x[s][one[0]][one[1]], x[s][other[0]][other[1]]
                    d = [b[k] - a[k] for k in range(3)]
                    long = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
                    va, vb = v[s][one[0]][one[1]], v[s][other[0]][other[1]]
                    rate = sum((vb[k] - va[k]) * d[k] for k in range(3))
                    pull = springs.stiffness[s, r, c] * (1 - length / long)
                    pull += springs.damping[s, r, c] * rate / (long * long)
                    for k in range(3):
                        force[s][one[0]][one[1]][k] += pull * d[k]
                        force[s][other[0]][other[1]][k] -= pull * d[k]
    return force


def mechanics() -> None:
    print("springs, node updates a second")
    for sheets in (1, 4, 16, 64):
        model = model_of(sheets)
        dt, state = StepLimit.of(model, 0.0).longest_step, SheetState.resting(model.rest * 1.01)

        def still(x: Vectors, _: Vectors) -> Vectors:
            return np.zeros_like(x)

        def run(model: SheetModel = model, state: SheetState = state, dt: float = dt) -> None:
            for _ in range(50):
                state = step(model, state, still, dt)

        rate = 50 * model.rest[..., 0].size / cpu(run)
        print(f"  {sheets:3} sheets of 24x16: {rate / 1e6:6.2f} million")
    model = model_of(1)
    x, v = (model.rest * 1.01).tolist(), np.zeros_like(model.rest).tolist()
    same = spring_force(model, model.rest * 1.01, np.zeros_like(model.rest))
    assert np.allclose(plain_force(model, x, v), same)
    rate = model.rest[..., 0].size / cpu(lambda: plain_force(model, x, v))
    print(f"  plain Python loop:     {rate / 1e6:6.3f} million (forces alone)")


def fire_source(side: int, count: int) -> SilkSource:
    keys = {"kind": "silk", "width": side, "height": side, "sheets": {"count": count}}
    return SilkSource.model_validate(keys)


def fire_of(side: int, count: int) -> SilkRenderer:
    settings = GenerationSettings(1, Wind(), 48, 24.0, True, Views())
    return generate_silk(fire_source(side, count), settings)


def frames() -> None:
    print("frames: CPU ms a frame; frames a second of wall clock, 2 workers")
    for side, count in ((128, 4), (256, 1), (256, 4), (256, 8), (256, 16), (512, 4), (1024, 4)):
        start = time.process_time()
        fire = fire_of(side, count)
        made = time.process_time() - start
        eye = silk_camera(fire_source(side, count), 30.0, 0.0)
        numbers = range(0, 48, 2)
        spent = cpu(lambda: [fire.draw(i, eye) for i in numbers], 2) / len(numbers)  # noqa: B023
        flow = cpu(lambda: [fire.motion(i, eye) for i in range(0, 48, 8)], 2) / 6  # noqa: B023
        with Workers(2) as workers:
            begin = time.perf_counter()
            list(workers.map(lambda i: fire.draw(i, eye), range(48)))  # noqa: B023
            wall = time.perf_counter() - begin
        print(
            f"  {side:4}², {count:2} sheets: {spent * 1e3:6.1f} ms, {48 / wall:6.1f} frames/s; "
            f"flow {flow * 1e3:5.1f} ms; simulated and painted in {made:.2f} s"
        )


if __name__ == "__main__":
    cv2.setNumThreads(1)
    mechanics()
    frames()
