"""Source ``fluid``: gas that burns, simulated once and rendered as a clip for each view."""

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from threading import Semaphore

import numpy as np

from fire_atlas.core.clip import Clip, frames_kept, kept
from fire_atlas.core.errors import RecipeError
from fire_atlas.generators.fluid.memory import Memory, memory_within_limit
from fire_atlas.generators.fluid.process import record_apart
from fire_atlas.generators.fluid.recording import is_led
from fire_atlas.generators.fluid.renderer import EDGE, FluidView, fluid_camera
from fire_atlas.generators.fluid.scene import Scene, build_scene, plays_once
from fire_atlas.generators.fluid.volume import Volume
from fire_atlas.generators.rendering import rendered_clip
from fire_atlas.generators.settings import GenerationSettings
from fire_atlas.recipe.fluid import FluidSource
from fire_atlas.sources.frames import Footage
from fire_atlas.sources.reader import OpeningContext

_LOOKED_AT = 6
"""Number of frames that are looked at for a fire that leaves the frame, or hardly fills it."""

_LEAVES, _SEEN = 0.25, 0.05
"""Coverage from which on fire leaves the frame, where half of its picture has faded towards a
side, and coverage from which on a place shows fire."""

_LEAST_FILLED = 0.1
"""Part of the frame's height below which a fire is small in it."""


def open_fluid(
    source: FluidSource, generation: GenerationSettings, context: OpeningContext
) -> list[Clip]:
    """Simulate the fire once, and return a clip for each view, which keeps its frames.

    They are drawn as soon as they are simulated, in threads that would wait for the simulation.

    Args:
        source: The recipe's ``source``.
        generation: Seed, wind, timing and views.
        context: Workers, and the encoding in which the client blends.

    Raises:
        RecipeError: As ``build_scene`` and ``memory_within_limit``; or the simulation broke.
    """
    scene, memory = _checked_scene(source, generation)
    settings = replace(generation, loop=scene.loop)
    views, volumes, turns = generation.views, list[Volume](), Semaphore(memory.at_once)
    seen = [
        FluidView(
            scene,
            volumes,
            fluid_camera(source, azimuth, views.elevation, views.distance),
            context.blend_space,
            turns,
        )
        for azimuth in generation.azimuths()
    ]
    clips = [
        kept(replace(rendered_clip(view, settings, context.blend_space, ()), hidden=view.smoke))
        for view in seen
    ]
    context.progress.stage("simulate", scene.settling + scene.frames)
    drawings: list[Future[None]] = []

    def keep(volume: Volume) -> None:
        """Let it be drawn in threads that have nothing to simulate."""
        volumes.append(volume)
        if (number := len(volumes) - 1) < frames_kept(clips[0]):
            drawings.extend(context.workers.start(partial(_draw, clip, number)) for clip in clips)

    with _held(turns, memory.at_once - memory.at_once_while_simulating):
        repeats = context.workers.start(
            lambda: record_apart(scene, context.workers.jobs, keep, context.progress.advance)
        ).result()
    context.progress.stage("draw", len(drawings))
    for drawing in drawings:
        drawing.result()
        context.progress.advance()
    notes = (*_notes(source, generation), *_of_recording(repeats), *_of_frame(clips[0], seen[0]))
    return [replace(clips[0], notes=notes), *clips[1:]]


def _draw(clip: Clip, number: int) -> None:
    """Draw a frame of a clip, which keeps it."""
    clip.picture(number)


@contextmanager
def _held(turns: Semaphore, count: int) -> Iterator[None]:
    """Hold so many free turns."""
    for _ in range(count):
        turns.acquire()
    try:
        yield
    finally:
        for _ in range(count):
            turns.release()


def examine_fluid(source: FluidSource, generation: GenerationSettings) -> Footage:
    """Return what is known of the fire before it is simulated.

    Raises:
        RecipeError: As ``build_scene`` and ``memory_within_limit``.
    """
    _checked_scene(source, generation)
    return Footage(
        generation.frames,
        (source.width, source.height),
        generation.fps,
        True,
        tuple(_notes(source, generation)),
    )


def _checked_scene(source: FluidSource, generation: GenerationSettings) -> tuple[Scene, Memory]:
    """Return the fire, and the memory that it takes."""
    scene = build_scene(source, generation)
    return scene, memory_within_limit(source, scene, generation)


def _notes(source: FluidSource, generation: GenerationSettings) -> Iterator[str]:
    if generation.loop and plays_once(source):
        why = "burning" if source.burning is not None else "blast" if source.blast else "fire"
        value = getattr(source, why)
        shown = list(value) if isinstance(value, tuple) else value
        yield f"plays once, as source.{why}: {shown} begins and ends; its last frame is empty"


def _of_recording(repeats: float | None) -> Iterator[str]:
    if repeats is not None:
        led = ", so its end is led to its beginning" if is_led(repeats) else " and needs no seam"
        yield (
            f"loops: a period apart the fire differs {repeats:.2f} times as much as from frame to "
            f"frame{led}"
        )


def _of_frame(clip: Clip, view: FluidView) -> Iterator[str]:
    """Yield notes on a fire that leaves the frame, or that is small in it."""
    most = np.zeros((clip.height, clip.width), np.float32)
    for index in sorted(
        {round(k * (clip.count - 1) / (_LOOKED_AT - 1)) for k in range(_LOOKED_AT)}
    ):
        np.maximum(most, clip.read(index)[..., 3], out=most)
    if not (most > _SEEN).any():
        raise RecipeError(
            "nothing is to be seen of this fire; use more fuel_rate, heat or smoke",
            key=("source",),
        )
    edge = round(EDGE / 2 * view.camera.scale)
    sides = {"top": most[edge], "left side": most[:, edge], "right side": most[:, -1 - edge]}
    if not view.scene.grid.has_ground:
        sides["lower edge"] = most[-1 - edge]
    left_at = [name for name, shown in sides.items() if shown.max() > _LEAVES]
    if left_at:
        # Lift carries gas to the top alone: it keeps none from the other sides.
        less = (
            "source.radius, fuel_rate or lift" if "top" in left_at else "source.radius or fuel_rate"
        )
        yield (
            f"the fire leaves the frame at its {' and '.join(left_at)}; use less {less}, or "
            "another aspect"
        )
    rows = np.flatnonzero((most > _SEEN).any(axis=1))
    if (rows[-1] + 1 - rows[0]) / len(most) < _LEAST_FILLED:
        yield "the fire fills less than a tenth of the frame; use more source.radius or fuel_rate"
