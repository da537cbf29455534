"""The effect, run on a clip in memory without any build."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.core.progress import Progress, SilentProgress
from fire_atlas.core.workers import Workers
from fire_atlas.effect.composition.composite import clip_palette
from fire_atlas.effect.field.buoyancy import lift_direction
from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from fire_atlas.effect.flame.study import FlameStudy, study_flame
from fire_atlas.pipeline.animation import analyse as analysis_of_frames
from fire_atlas.pipeline.animation.analyse import Analysis, analyse
from fire_atlas.pipeline.animation.classify import classify
from fire_atlas.pipeline.animation.layers import SimulatedClip, compose_layers, layers_of
from fire_atlas.pipeline.animation.simulate import simulate
from fire_atlas.recipe.models import Recipe
from fire_atlas.timeline.arrange import arrange
from fire_atlas.vision.flow import optical_flow

Array = NDArray[np.float64]
Plane = NDArray[np.float32]

_LIFE = 2.6
"""Seconds a flake lives at most, by default."""

ID, X, Y, VX, VY, SIZE, STRETCH, ROTATION, R, G, B, A, AGE, LIFE, KIND, BLUR, TAIL = range(
    len(COLUMNS)
)


@dataclass(frozen=True)
class EffectRun:
    """The effect, run on a clip."""

    clip: Clip
    recipe: Recipe
    study: FlameStudy
    analysis: Analysis

    @cached_property
    def tracks(self) -> Tracks:
        """The flight of its flakes; many tests ask for no more than their births."""
        with Workers(2) as workers:
            return simulate(self.clip, self.study, self.analysis, self.recipe, context_of(workers))

    def finished(self, i: int) -> Pixels:
        """Return frame ``i`` as it goes into the atlas."""
        palette = None
        if self.recipe.composite.palette == "clip":
            with Workers(1) as workers:
                palette = clip_palette(self.clip, workers)
        layers = layers_of(i, self.simulated, self.recipe)
        return as_light(compose_layers(layers, self.recipe, palette))

    @property
    def simulated(self) -> SimulatedClip:
        """Return what rendering reads."""
        return SimulatedClip(self.clip, self.study, self.analysis, (self.tracks,))

    @property
    def rows(self) -> Array:
        """All rows of all frames."""
        return np.concatenate(self.tracks.frames)

    @property
    def births(self) -> Array:
        """(flakes, 2): where every flake was born, px, whether it was ever seen or not."""
        return np.column_stack([self.analysis.spawns.x, self.analysis.spawns.y])

    def flights(self, least: int = 1) -> list[Array]:
        """Return the rows of each flake that has ``least`` of them, in the order of its life."""
        rows = self.rows[np.lexsort((self.rows[:, AGE], self.rows[:, ID]))]
        flights = np.split(rows, np.flatnonzero(np.diff(rows[:, ID])) + 1)
        return [flight for flight in flights if len(flight) >= least]


def recipe_of(keys: Mapping[str, Any]) -> Recipe:
    """Return a recipe of ``keys``; its source is never opened."""
    return Recipe.model_validate({"source": {"path": "clip"}, **keys})


def context_of(workers: Workers, progress: Progress | None = None) -> BuildContext:
    """Return the context of steps that are run without a build."""
    context = BuildContext.silent(workers)
    return replace(context, progress=progress) if progress else context


@lru_cache(maxsize=256)  # 0.2 MB each on average
def _flow(before: bytes, after: bytes, shape: tuple[int, int], is_small: bool) -> Plane:
    one, other = (np.frombuffer(each, np.uint8).reshape(shape) for each in (before, after))
    flow = optical_flow(one, other, is_small)
    flow.flags.writeable = False
    return flow


def _flow_found_once(before: Bytes, after: Bytes, is_small: bool) -> Plane:
    """Return what ``optical_flow`` does, which takes half of an analysis: tests analyse the same
    frames again, in clips that are played again and again and with other recipes."""
    height, width = before.shape
    return _flow(before.tobytes(), after.tobytes(), (height, width), is_small)


def run_effect(clip: Clip, keys: Mapping[str, Any] | None = None, jobs: int = 2) -> EffectRun:
    """Run the effect on ``clip`` with a recipe of ``keys``."""
    recipe = recipe_of(keys or {})
    with Workers(jobs) as workers:
        clip = arrange(clip, recipe.timeline, _LIFE, workers, SilentProgress())
        context = context_of(workers)
        study = study_flame(clip, recipe.features, lift_direction(recipe.buoyancy), workers)
        recipe = classify(recipe, clip, study, context)
        with patch.object(analysis_of_frames, "optical_flow", _flow_found_once):
            analysis = analyse(clip, study, recipe, context)
    return EffectRun(clip, recipe, study, analysis)


def pixel_of(rows: Array, clip: Clip) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Row and column of the pixel each of the track's ``rows`` lies in, the nearest if outside."""
    row = np.clip(np.floor(rows[:, Y]).astype(np.intp), 0, clip.height - 1)
    column = np.clip(np.floor(rows[:, X]).astype(np.intp), 0, clip.width - 1)
    return row, column
