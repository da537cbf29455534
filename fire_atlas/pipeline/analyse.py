"""Analyse a clip: find where flakes are born, and record the velocity field that carries them.

Frames are analysed by all workers; the field is solved frame by frame in one thread.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, Window, cropped
from fire_atlas.core.picture import as_light, brightness_of
from fire_atlas.core.pixels import Bytes, Plane, magnitude
from fire_atlas.effect.field.forcing import (
    Forcing,
    cell_means,
    flow_on_grid,
    halve_descent,
    pad_to_grid,
)
from fire_atlas.effect.field.record import FieldRecord, forcing_order, record_field
from fire_atlas.effect.field.wind import wind_in_view
from fire_atlas.effect.flakes.emission import EmitterSettings, Spawns, emit, with_bursts_in_rate
from fire_atlas.effect.flakes.rounds import rounds_of
from fire_atlas.effect.flame.features import feature_vectors, refine
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.recipe.effect import Buoyancy, Features, Flakes, FlakesOrNone
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.wind import Wind
from fire_atlas.vision.flow import SMALL, optical_flow, shrunk_flow, thumbnail

_SURE_SPAWNS = 5
"""If more spawns than this are expected, none at all is hardly chance, and worth a note."""


@dataclass(frozen=True, slots=True)
class AnalysisSettings:
    """The sections of a recipe that the analysis reads.

    Attributes:
        wind: The wind as seen from the direction of the clip's view.
        flakes_in_pages: Whether flakes are drawn into pages or maps.
    """

    seed: int
    features: Features
    buoyancy: Buoyancy
    flakes: FlakesOrNone
    wind: Wind
    flakes_in_pages: bool

    @classmethod
    def of(cls, recipe: Recipe, azimuth: float = 0.0) -> Self:
        """Return the sections of a recipe.

        ``azimuth`` is the direction of the clip's view, degrees counter-clockwise from above.
        """
        wind, flakes = wind_in_view(recipe.wind, azimuth), recipe.flakes
        in_pages = flakes != "none" and (flakes.bake or recipe.maps.flakes)
        return cls(recipe.seed, recipe.features, recipe.buoyancy, flakes, wind, in_pages)

    def rounds(self, clip: Clip) -> int:
        """Return how many rounds of a clip its flakes are simulated for."""
        if self.flakes == "none":
            return 1
        return rounds_of(self.flakes, clip, in_pages=self.flakes_in_pages)


@dataclass(frozen=True, slots=True)
class Analysis:
    """Result of the analysis of a clip.

    Attributes:
        field: The recorded buoyancy field, of one round of a loop.
        spawns: Spawns of all flakes, in all rounds.
        rounds: Number of rounds of a loop after which its flakes repeat.
    """

    field: FieldRecord
    spawns: Spawns
    rounds: int


@dataclass(frozen=True, slots=True)
class _FrameAnalysis:
    """Result of the analysis of one frame on its own.

    Attributes:
        thumbnail: (h, w) uint8, for the optical flow.
        flow: (h, w, 2), px of the thumbnail per frame; None unless the source states motion.
        mask: (H, W) float32, confidence that each pixel is flame, 0..1.
        lit: (rows, columns), brightness of each cell, 0..1.
        feature_x, feature_y: (rows, columns), mean of Fv* in each cell, in units of its mean length
            in the clip.
        spawns: Flakes born in this frame, in all rounds of the clip.
        is_reversed: Whether the clip runs backwards from this frame to the next.
    """

    thumbnail: Bytes
    flow: NDArray[np.float32] | None
    mask: Plane
    lit: Plane
    feature_x: Plane
    feature_y: Plane
    spawns: Spawns
    is_reversed: bool


def analyse(
    clip: Clip, study: FlameStudy, settings: AnalysisSettings, context: BuildContext
) -> Analysis:
    """Find features, flow and spawns of every frame, and record the buoyancy field."""
    context.progress.stage("analyse", clip.count)
    emitter = _emitter(clip, study, settings)
    spawns_of = dict[int, Spawns]()

    def forcings() -> Iterator[Forcing]:
        for i, spawns, forcing in _frames(clip, study, settings, emitter, context):
            spawns_of[i] = spawns
            context.progress.advance()
            yield forcing

    field = record_field(
        forcings(), clip, settings.buoyancy, study.buoyancy, settings.wind, settings.seed
    )
    spawns = Spawns.concatenate([spawns_of[i] for i in sorted(spawns_of)])
    spawns = with_bursts_in_rate(spawns, settings.seed)
    if study.dies_out and not clip.loop and not clip.tail:
        spawns = spawns.cooled_by((clip.count - 1) / clip.fps)
    if not len(spawns.tick) and emitter.rate * clip.body / clip.fps > _SURE_SPAWNS:
        context.progress.note(
            "no flake is born: no flame in the clip moves, or features.epsilon, "
            "features.clamp or flakes.alpha is too high for its edges"
        )
    return Analysis(field, spawns, settings.rounds(clip))


def _emitter(clip: Clip, study: FlameStudy, settings: AnalysisSettings) -> EmitterSettings:
    # Without flakes the field may still be needed, to blur the flame along it.
    flakes = settings.flakes if settings.flakes != "none" else Flakes(rate=0, bursts=0)
    return EmitterSettings.of(
        flakes,
        clip,
        moving_area=study.moving_area,
        candidate_count=study.candidate_count,
        automatic_alpha=study.alpha,
        seed=settings.seed,
    )


def _frames(
    clip: Clip,
    study: FlameStudy,
    settings: AnalysisSettings,
    emitter: EmitterSettings,
    context: BuildContext,
) -> Iterator[tuple[int, Spawns, Forcing]]:
    """Yield index, spawns and forcing of each frame, in ``forcing_order``."""
    cell = settings.buoyancy.cell
    # As in the paper, flakes may be born anywhere; otherwise only where something moves.
    everywhere = settings.features.preset == "paper"
    window = Window(0, 0, clip.width, clip.height) if everywhere else study.active_window(cell)
    analyser = _FrameAnalyser(
        cropped(clip, window),
        study.cropped(window),
        settings,
        emitter,
        is_small=clip.width * clip.height <= SMALL,
        rounds=settings.rounds(clip),
    )
    order = forcing_order(clip)
    pairs = _pairs(context.workers.map(analyser.frame, order), clip.loop)
    size = clip.width, clip.height
    done = context.workers.map(lambda pair: (pair[0].spawns, analyser.forcing(*pair)), pairs)
    for i, (spawns, forcing) in zip(order, done, strict=True):
        yield i, spawns.shifted(window.left, window.top), pad_to_grid(forcing, window, size, cell)


@dataclass(frozen=True, slots=True)
class _FrameAnalyser:
    """Analyses single frames of a clip; its methods run in several threads.

    Attributes:
        clip: The clip, possibly cropped to where something moves.
        study: Constants of the whole clip.
        settings: Sections of the recipe.
        emitter: How flakes are spawned.
        is_small: Whether frames are so small that flow is computed at a finer scale.
        rounds: Number of rounds of the clip, each with flakes of its own.
    """

    clip: Clip
    study: FlameStudy
    settings: AnalysisSettings
    emitter: EmitterSettings
    is_small: bool
    rounds: int

    def frame(self, i: int) -> _FrameAnalysis:
        """Return the analysis of frame ``i`` on its own."""
        clip, study, cell = self.clip, self.study, self.settings.buoyancy.cell
        picture = clip.picture(i)
        bright = brightness_of(picture, clip.blend_space)
        mask = study.segmentation.mask(bright, lambda: as_light(picture))
        features = self.settings.features
        fx, fy = refine(
            *feature_vectors(bright, features.sigma, study.epsilon, study.kappa),
            study.buoyancy, features.beta, features.clamp,
        )  # fmt: skip
        strength = magnitude(fx, fy)
        if features.preset == "auto":
            strength = strength * mask
        unit = np.float32(1 / study.mean_feature)
        small = thumbnail(bright, self.is_small)
        return _FrameAnalysis(
            small,
            None if clip.flow is None else shrunk_flow(clip.flow(i), small.shape, clip.fps),
            mask,
            cell_means(study.segmentation.lit(bright), cell),
            cell_means(fx, cell) * unit,
            cell_means(fy, cell) * unit,
            self._spawns(i, strength),
            i in clip.backwards,
        )

    def _spawns(self, i: int, strength: Plane) -> Spawns:
        """Return the flakes born in frame ``i``: in each round others, by its random numbers."""
        if i >= self.clip.body:
            return Spawns.empty()
        times = [i + each * self.clip.count for each in range(self.rounds)]
        return Spawns.concatenate([emit(time, strength, self.emitter) for time in times])

    def forcing(self, here: _FrameAnalysis, other: _FrameAnalysis, is_last: bool) -> Forcing:
        """Return the forcing of the velocity field by ``here``, given the neighbour ``other``."""
        # The last frame continues the motion before it. Where the clip runs backwards, the flow is
        # taken forwards: hot gas always rises.
        before, after = (other, here) if is_last or here.is_reversed else (here, other)
        flow = here.flow
        if flow is None:
            flow = optical_flow(before.thumbnail, after.thumbnail, self.is_small)
        clip, cell = self.clip, self.settings.buoyancy.cell
        u, v = flow_on_grid(flow, here.mask, (clip.width, clip.height), cell, clip.fps)
        u, v = halve_descent(u, v, self.study.buoyancy)
        flame = cell_means(here.mask, cell)
        return Forcing(flame, here.lit, u, v, here.feature_x, here.feature_y)


def _pairs(
    frames: Iterator[_FrameAnalysis], loop: bool
) -> Iterator[tuple[_FrameAnalysis, _FrameAnalysis, bool]]:
    """Yield each frame with the one after it, and whether it is the last.

    In a ``loop`` the first frame follows the last, so that none is the last. Otherwise the last
    frame comes with the one before it.
    """
    first = previous = here = next(frames)
    for following in frames:
        yield here, following, False
        previous, here = here, following
    yield (here, first, False) if loop else (here, previous, True)
