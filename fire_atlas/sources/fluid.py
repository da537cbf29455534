"""Source ``fluid``: gas that burns, simulated once and rendered as a clip for each view."""

from collections.abc import Iterator
from dataclasses import replace
from threading import Semaphore

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import RecipeError
from fire_atlas.generators.fluid.memory import memory_within_limit
from fire_atlas.generators.fluid.process import record_apart
from fire_atlas.generators.fluid.recording import FluidRecording
from fire_atlas.generators.fluid.renderer import EDGE, FluidView, fluid_camera
from fire_atlas.generators.fluid.scene import Scene, build_scene, plays_once
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
    """Simulate the fire once, and return a clip for each view.

    Args:
        source: The recipe's ``source``.
        generation: Seed, wind, timing and views.
        context: Workers, and the encoding in which the client blends.

    Raises:
        RecipeError: As ``build_scene`` and ``memory_within_limit``; or the simulation broke.
    """
    scene, turns = _checked_scene(source, generation)
    context.progress.stage("simulate", scene.settling + scene.frames)
    recording = context.workers.start(
        lambda: record_apart(scene, context.workers.jobs, context.progress.advance)
    ).result()
    settings = replace(generation, loop=scene.loop)
    views = generation.views
    seen = [
        FluidView(
            scene,
            recording,
            fluid_camera(source, azimuth, views.elevation, views.distance),
            context.blend_space,
            turns,
        )
        for azimuth in generation.azimuths()
    ]
    notes = (*_notes(source, generation), *_of_recording(recording), *_of_frame(seen[0]))
    return [
        replace(
            rendered_clip(view, settings, context.blend_space, ()),
            hidden=view.smoke,
            notes=notes if k == 0 else (),
        )
        for k, view in enumerate(seen)
    ]


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


def _checked_scene(source: FluidSource, generation: GenerationSettings) -> tuple[Scene, Semaphore]:
    """Return the fire, and as many turns at drawing it as its memory allows."""
    scene = build_scene(source, generation)
    return scene, Semaphore(memory_within_limit(source, scene, generation).at_once)


def _notes(source: FluidSource, generation: GenerationSettings) -> Iterator[str]:
    if generation.loop and plays_once(source):
        why = "burning" if source.burning is not None else "blast" if source.blast else "fire"
        value = getattr(source, why)
        shown = list(value) if isinstance(value, tuple) else value
        yield f"plays once, as source.{why}: {shown} begins and ends; its last frame is empty"


def _of_recording(recording: FluidRecording) -> Iterator[str]:
    if recording.repeats is not None:
        led = ", so its end is led to its beginning" if recording.is_led else " and needs no seam"
        yield (
            f"loops: a period apart the fire differs {recording.repeats:.2f} times as much as from "
            f"frame to frame{led}"
        )


def _of_frame(view: FluidView) -> Iterator[str]:
    """Yield notes on a fire that leaves the frame, or that is small in it."""
    count = len(view.recording.volumes)
    most = np.zeros((view.camera.height, view.camera.width), np.float32)
    for index in sorted({round(k * (count - 1) / (_LOOKED_AT - 1)) for k in range(_LOOKED_AT)}):
        np.maximum(most, view.frame(index)[..., 3], out=most)
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
