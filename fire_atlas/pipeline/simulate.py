"""Simulate the flakes of a clip in the recorded velocity field (Kim & Lee, section III-C)."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import hex_to_linear
from fire_atlas.effect.flakes.appearance import (
    EMBER_LIGHT,
    Appearance,
    spawn_table,
    track_rows,
)
from fire_atlas.effect.flakes.emission import limit_alive
from fire_atlas.effect.flakes.flight import FlightSettings, ParticleState, fly
from fire_atlas.effect.flakes.tracks import Tracks, fold_into_loop
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.analyse import Analysis
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.recipe.effect import Buoyancy, Composite, Flakes, MotionBlur, MotionBlurOrNone
from fire_atlas.recipe.models import Recipe


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """The sections of a recipe that the simulation reads."""

    seed: int
    flakes: Flakes
    buoyancy: Buoyancy
    motion_blur: MotionBlurOrNone
    composite: Composite

    @classmethod
    def of(cls, recipe: Recipe) -> Self:
        """Return the sections of a recipe that has flakes."""
        if recipe.flakes == "none":
            raise ValueError("without flakes there is nothing to simulate")
        return cls(
            recipe.seed, recipe.flakes, recipe.buoyancy, recipe.motion_blur, recipe.composite
        )

    @property
    def shutter(self) -> float:
        """Fraction of a frame's time during which the shutter is open, 0..1."""
        return self.motion_blur.shutter if isinstance(self.motion_blur, MotionBlur) else 0.0


def simulate(
    clip: Clip,
    study: FlameStudy,
    analysis: Analysis,
    settings: SimulationSettings,
    context: BuildContext,
) -> Tracks:
    """Move the flakes through the recorded field, and return what each does in every frame."""
    flakes, spawns, progress = settings.flakes, analysis.spawns, context.progress
    shown = clip.count * analysis.rounds
    if clip.loop:
        spawns = limit_alive(spawns, flakes.max, shown, clip.fps, settings.seed)
    # The flakes of a loop fly on past its end, until the last one has burnt out.
    count = shown + (math.ceil(flakes.life[1] * clip.fps) + 1 if clip.loop else 0)
    progress.stage("fly", count)
    states = list[ParticleState]()

    def flying() -> Iterator[ParticleState]:
        for state in fly(spawns, analysis.field, count, _flight(clip, settings)):
            states.append(state)
            progress.advance()
            yield state

    look = _appearance(clip, study, settings)
    frames = list(track_rows(flying(), spawns, look, context.workers))
    table, size = spawn_table(states, spawns, frames), (clip.width, clip.height)
    tracks = Tracks.one_shot(clip.fps, size, settings.seed, table, frames, look.pixel)
    return fold_into_loop(tracks, shown, analysis.rounds) if clip.loop else tracks


def _flight(clip: Clip, settings: SimulationSettings) -> FlightSettings:
    """Return how flakes fly in a clip, in px and s."""
    flakes, buoyancy = settings.flakes, settings.buoyancy
    return FlightSettings(
        seed=settings.seed,
        scatter=flakes.scatter,
        lag=flakes.lag,
        gravity=buoyancy.gravity * clip.height,
        turbulence=buoyancy.turbulence * clip.height,
        # Flakes that fade at the edge are dark before they leave the frame.
        streak=(flakes.stretch + settings.shutter) / clip.fps if flakes.edge == "crop" else 0.0,
        max_alive=flakes.max,
        width=clip.width,
        height=clip.height,
    )


def _appearance(clip: Clip, study: FlameStudy, settings: SimulationSettings) -> Appearance:
    """Return how flakes look in a clip."""
    flakes = settings.flakes
    is_ember = flakes.colors == "auto"
    colours = np.array([EMBER_LIGHT]) if is_ember else hex_to_linear(flakes.colors)
    return Appearance(
        seed=settings.seed,
        colours=colours.astype(np.float64),
        intensity=flakes.intensity * settings.composite.intensity,
        stretch=flakes.stretch,
        shutter=settings.shutter,
        kappa=study.kappa,
        fades=flakes.edge == "fade",
        pixel=flakes.sprite == "pixel",
        fps=clip.fps,
    )
