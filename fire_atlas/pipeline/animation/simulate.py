"""Simulate the flakes of a clip in the recorded velocity field (Kim & Lee, section III-C).

The flakes of a fire with depth fly once, in three dimensions, and every view shows the same ones.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import tee

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.chance import RandomStream, seed_of
from fire_atlas.core.clip import Clip, depth_of
from fire_atlas.core.context import BuildContext
from fire_atlas.core.pixels import hex_to_linear
from fire_atlas.effect.field.record import FieldRecord
from fire_atlas.effect.flakes.appearance import (
    EMBER_LIGHT,
    Appearance,
    spawn_table,
    track_rows,
)
from fire_atlas.effect.flakes.emission import Spawns, limit_alive
from fire_atlas.effect.flakes.flight import FlightField, FlightSettings, fly
from fire_atlas.effect.flakes.particles import FlakeView, ParticleState
from fire_atlas.effect.flakes.texture import TextureCells
from fire_atlas.effect.flakes.tracks import (
    Table,
    Tracks,
    TrackTexture,
    first_frames,
    fold_into_loop,
    visible_count,
)
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.animation.analyse import Analysis, glare_of
from fire_atlas.recipe.models import Recipe
from fire_atlas.timeline.tail import shortened


def recipes_of_sets(recipe: Recipe) -> Iterator[Recipe]:
    """Yield the recipe with the seed of each set of its flakes; the first has its own."""
    for number in range(recipe.some_flakes().variants):
        seed = seed_of(recipe.seed, RandomStream.FLAKE_SETS, number)
        yield recipe.model_copy(update={"seed": seed})


def simulate(
    clip: Clip,
    study: FlameStudy,
    analysis: Analysis,
    recipe: Recipe,
    context: BuildContext,
    texture: TextureCells | None = None,
) -> Tracks:
    """Move the flakes through the recorded field, and return what each does in every frame.

    With a ``texture``, also which of its cells each shows; their names are numbers here.
    """
    spawns = _limited(clip, analysis, recipe)
    states = _flying(clip, FlightField(analysis.field), spawns, analysis.rounds, recipe, context)
    look = _appearance(clip, study, analysis.glare, analysis.field.cell, recipe, texture)
    return _tracks(clip, spawns, states, analysis.rounds, look, context)


@dataclass(frozen=True, slots=True)
class FlightInDepth:
    """The flakes of a fire with depth, flown in the px of its front.

    Attributes:
        front: The camera in front of the fire: level, with parallel lines of sight.
        spawns: All flakes.
        states: The flakes of each frame; those of a loop fly on past its end.
        rounds: Number of rounds of a loop after which they repeat.
        cell: Side of a cell of the field, px.
    """

    front: Camera
    spawns: Spawns
    states: tuple[ParticleState, ...]
    rounds: int
    cell: int


def simulate_in_depth(
    clip: Clip,
    analysis: Analysis,
    side: FieldRecord,
    cameras: Sequence[Camera],
    recipe: Recipe,
    context: BuildContext,
) -> FlightInDepth:
    """Move flakes through the fields of two views at a right angle, and return their flight.

    Args:
        clip: The fire seen from the front: level, with parallel lines of sight.
        analysis: Its analysis, with places in depth.
        side: The recorded field of the view from its right.
        cameras: The cameras of all views; a flake flies until it has left all their frames.
        recipe: The recipe, which has flakes.
        context: Workers and progress.
    """
    front = depth_of(clip)
    spawns = _limited(clip, analysis, recipe)
    air = FlightField(analysis.field, side, front.camera.origin[0])
    views = tuple(FlakeView(front.camera, camera, front.hidden) for camera in cameras)
    flying = _flying(clip, air, spawns, analysis.rounds, recipe, context, views)
    cell = analysis.field.cell
    return FlightInDepth(front.camera, spawns, tuple(flying), analysis.rounds, cell)


def see_flight(
    clip: Clip,
    study: FlameStudy,
    flight: FlightInDepth,
    recipe: Recipe,
    context: BuildContext,
    texture: TextureCells | None = None,
) -> Tracks:
    """Return what the camera of a clip sees of flakes that have flown in depth."""
    seen = depth_of(clip)
    view = FlakeView(flight.front, seen.camera, seen.hidden)
    glare = glare_of(clip, flight.cell, context)
    look = _appearance(clip, study, glare, flight.cell, recipe, texture)
    look = replace(look, view=view)
    states = map(view.seen, flight.states)
    return _tracks(clip, view.seen_spawns(flight.spawns), states, flight.rounds, look, context)


def _limited(clip: Clip, analysis: Analysis, recipe: Recipe) -> Spawns:
    """Return the spawns of a clip; in a loop, so many that the limit on flakes alive is kept."""
    if not clip.loop:
        return analysis.spawns
    shown = clip.count * analysis.rounds
    return limit_alive(analysis.spawns, recipe.some_flakes().max, shown, clip.fps, recipe.seed)


def _flying(
    clip: Clip,
    air: FlightField,
    spawns: Spawns,
    rounds: int,
    recipe: Recipe,
    context: BuildContext,
    views: tuple[FlakeView, ...] = (),
) -> Iterator[ParticleState]:
    """Yield the flakes of each frame; in a loop also past its end, until all have burnt out."""
    after = math.ceil(recipe.some_flakes().life[1] * clip.fps) + 1 if clip.loop else 0
    count = clip.count * rounds + after
    context.progress.stage("fly", count)
    for state in fly(spawns, air, count, _flight(clip, recipe, views)):
        context.progress.advance()
        yield state


def _tracks(
    clip: Clip,
    spawns: Spawns,
    flight: Iterable[ParticleState],
    rounds: int,
    look: Appearance,
    context: BuildContext,
) -> Tracks:
    """Return the tracks of flakes with the look that they have in a clip."""
    noted, states = tee(flight)
    frames = list(track_rows(noted, spawns, look, context.workers))
    camera = None if look.view is None else look.view.camera
    table = spawn_table(list(states), spawns, frames, camera is not None)
    size = clip.width, clip.height
    cells = None if look.texture is None else _cells(look.texture, frames, look.seed)
    tracks = Tracks.one_shot(
        clip.fps, size, look.seed, table, frames, look.art is not None, cells, camera
    )
    return fold_into_loop(tracks, clip.count * rounds, rounds) if clip.loop else tracks


def _cells(texture: TextureCells, frames: list[Table], seed: int) -> TrackTexture:
    """Return which cells the rows of all frames show."""
    names = tuple(f"{i:04}" for i in range(len(texture.light)))
    cells = tuple(texture.cells_of(rows, seed) for rows in frames)
    return TrackTexture(names, texture.tinted, cells)


def _flight(clip: Clip, recipe: Recipe, views: tuple[FlakeView, ...]) -> FlightSettings:
    """Return how flakes fly in a clip, in px and s."""
    flakes, buoyancy = recipe.some_flakes(), recipe.buoyancy
    return FlightSettings(
        seed=recipe.seed,
        scatter=flakes.scatter,
        lag=flakes.lag * flakes.own_motion,
        gravity=buoyancy.gravity * clip.height,
        turbulence=buoyancy.turbulence * clip.height,
        # Flakes that fade at the edge are dark before they leave the frame.
        streak=(flakes.stretch + recipe.shutter) / clip.fps if flakes.edge == "crop" else 0.0,
        max_alive=flakes.max,
        width=clip.width,
        height=clip.height,
        views=views,
        own_motion=flakes.own_motion,
    )


def _appearance(
    clip: Clip,
    study: FlameStudy,
    glare: NDArray[np.uint8],
    cell: int,
    recipe: Recipe,
    texture: TextureCells | None,
) -> Appearance:
    """Return how flakes look in a clip, with the ``glare`` of its flame in each ``cell``."""
    flakes = recipe.some_flakes()
    is_ember = flakes.colors == "auto"
    # What hides the flame, or has the colours of art, is not dimmed by its light.
    is_lost_in_glare = is_ember and recipe.composite.blend == "add"
    colours = np.array([EMBER_LIGHT]) if is_ember else hex_to_linear(flakes.colors)
    if texture is not None and not texture.tinted:
        colours, is_lost_in_glare = np.ones((1, 3)), False  # the texture has its own
    return Appearance(
        seed=recipe.seed,
        colours=colours.astype(np.float64),
        intensity=flakes.intensity * recipe.composite.intensity,
        stretch=flakes.stretch,
        shutter=recipe.shutter,
        kappa=study.kappa,
        glare=glare if is_lost_in_glare else np.zeros((1, 1, 1), np.uint8),
        cell=cell,
        fades=flakes.edge == "fade",
        art=study.art if flakes.sprite == "pixel" else None,
        fps=clip.fps,
        texture=texture,
        count=clip.count,
        is_even=recipe.features.preset == "paper",
    )


def without_dark_end(clip: Clip, tracks: Sequence[Tracks]) -> tuple[Clip, tuple[Tracks, ...]]:
    """Return clip and all tracks without the last frames of a tail in which no flake is visible."""
    if not clip.tail:
        return clip, tuple(tracks)
    tail = range(clip.body, clip.count)
    lit = [n for n in tail if any(visible_count(each.frames[n]) for each in tracks)]
    clip = shortened(clip, lit[-1] + 1 - clip.body if lit else 0)
    return clip, tuple(first_frames(each, clip.count) for each in tracks)
