"""Analyse a clip: where flakes are born, and the field that will carry them.

Frames are looked at in the pool; the air is carried from one to the next in one thread.
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
from fire_atlas.effect.flakes.emission import EmitterSettings, Spawns, emit
from fire_atlas.effect.flame.features import feature_vectors, refine
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.recipe.effect import Buoyancy, Features, Flakes, FlakesOrNone
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.wind import Wind
from fire_atlas.vision.flow import SMALL, optical_flow, shrunk_flow, thumbnail

_MANY = 5
"""So many expected births are not left out by chance."""


@dataclass(frozen=True, slots=True)
class AnalysisSettings:
    """The sections of a recipe that the analysis reads.

    Attributes:
        wind: As it blows in the clip's own view.
    """

    seed: int
    features: Features
    buoyancy: Buoyancy
    flakes: FlakesOrNone
    wind: Wind

    @classmethod
    def of(cls, recipe: Recipe, azimuth: float = 0.0) -> Self:
        """Take the sections from a recipe.

        ``azimuth`` is the direction of the clip's view, degrees counter-clockwise from above.
        """
        wind = wind_in_view(recipe.wind, azimuth)
        return cls(recipe.seed, recipe.features, recipe.buoyancy, recipe.flakes, wind)


@dataclass(frozen=True, slots=True)
class Analysis:
    """What is known of a clip once all its frames were seen.

    Attributes:
        field: The recorded buoyancy field.
        spawns: Births of all flakes.
    """

    field: FieldRecord
    spawns: Spawns


@dataclass(frozen=True, slots=True)
class _FrameAnalysis:
    """What one frame of the clip says, before its neighbours are known.

    Attributes:
        thumbnail: (h, w) uint8, for the optical flow.
        flow: (h, w, 2), px of the thumbnail a frame, where the clip knows its own motion.
        mask: (H, W) float32, how surely each pixel is flame, 0..1.
        lit: (rows, columns), how bright each cell is, 0..1.
        feature_x, feature_y: (rows, columns), mean Fv* of each cell in typical lengths.
        spawns: Flakes born in this frame.
        is_reversed: Whether the clip goes backwards from this frame to the next.
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
    """Find features, flow and births of every frame and record the buoyancy field.

    Args:
        clip: The clip as it is played.
        study: What holds for the whole clip.
        settings: What the recipe says.
        context: The pool, and who hears of the progress.
    """
    context.progress.stage("analyse", clip.count)
    emitter = _emitter(clip, study, settings)
    births = dict[int, Spawns]()

    def drives() -> Iterator[Forcing]:
        for i, spawns, drive in _frames(clip, study, settings, emitter, context):
            births[i] = spawns
            context.progress.advance()
            yield drive

    field = record_field(drives(), clip, settings.buoyancy, settings.wind, settings.seed)
    spawns = Spawns.concatenate([births[i] for i in sorted(births)])
    if study.burns_out and not clip.loop and not clip.tail:
        spawns = spawns.cooled_by((clip.count - 1) / clip.fps)
    if not len(spawns.tick) and emitter.rate * clip.body / clip.fps > _MANY:
        context.progress.note(
            "no flake is born: nothing in the clip is flame that moves, or features.epsilon, "
            "features.clamp or flakes.alpha is above all of its edges"
        )
    return Analysis(field, spawns)


def _emitter(clip: Clip, study: FlameStudy, settings: AnalysisSettings) -> EmitterSettings:
    # Without flakes the flame may still be blurred along the field: nothing is born then.
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
    """Yield number, births and drive of each frame, in ``forcing_order``."""
    cell = settings.buoyancy.cell
    # The paper's candidates are anywhere in the image; else only where something moves.
    everywhere = settings.features.preset == "paper"
    window = Window(0, 0, clip.width, clip.height) if everywhere else study.active_window(cell)
    analyser = _FrameAnalyser(
        cropped(clip, window),
        study.cropped(window),
        settings,
        emitter,
        is_small=clip.width * clip.height <= SMALL,
    )
    order = forcing_order(clip)
    pairs = _pairs(context.workers.map(analyser.frame, order), clip.loop)
    size = clip.width, clip.height
    driven = context.workers.map(lambda pair: (pair[0].spawns, analyser.drive(*pair)), pairs)
    for i, (spawns, drive) in zip(order, driven, strict=True):
        yield i, spawns.shifted(window.left, window.top), pad_to_grid(drive, window, size, cell)


@dataclass(frozen=True, slots=True)
class _FrameAnalyser:
    """Analyses single frames of a clip; its methods run in the pool.

    Attributes:
        clip: The clip, or the part of its frames where anything moves.
        study: What holds for all frames.
        settings: What the recipe says.
        emitter: How flakes are spawned.
        is_small: Whether the clip's frames are small enough for a close look at their flow.
    """

    clip: Clip
    study: FlameStudy
    settings: AnalysisSettings
    emitter: EmitterSettings
    is_small: bool

    def frame(self, i: int) -> _FrameAnalysis:
        """Return everything that frame ``i`` says on its own."""
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
            emit(i, strength, self.emitter) if i < clip.body else Spawns.empty(),
            i in clip.backwards,
        )

    def drive(self, here: _FrameAnalysis, other: _FrameAnalysis, is_last: bool) -> Forcing:
        """Return what a frame does to the air, now that its neighbour is known."""
        # Where nothing follows, motion goes on as before; where the clip runs backwards, the gas of
        # the flame does not.
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
    frames: Iterator[_FrameAnalysis], closes: bool
) -> Iterator[tuple[_FrameAnalysis, _FrameAnalysis, bool]]:
    """Yield each frame with the one that follows it.

    In a circle that ``closes`` the first follows the last. Otherwise nothing does: the last comes
    with the one before it, and True.
    """
    first = previous = here = next(frames)
    for following in frames:
        yield here, following, False
        previous, here = here, following
    yield (here, first, False) if closes else (here, previous, True)
