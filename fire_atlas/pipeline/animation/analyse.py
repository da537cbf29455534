"""Analyse a clip: find where flakes are born, and record the velocity field that carries them.

Frames are analysed by all workers; the field is solved frame by frame in one thread.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, FireInDepth, Values, Window, cropped
from fire_atlas.core.context import BuildContext
from fire_atlas.core.picture import Picture, as_light, brightest_shown, brightness_of
from fire_atlas.core.pixels import Bytes, Plane, magnitude
from fire_atlas.effect.field.buoyancy import BuoyancySolver
from fire_atlas.effect.field.forcing import (
    Forcing,
    cell_means,
    flow_on_grid,
    halve_descent,
    padded_to_grid,
)
from fire_atlas.effect.field.record import FieldRecord, forcing_order, record_field, solve_field
from fire_atlas.effect.flakes.emission import (
    Candidates,
    EmitterSettings,
    Spawns,
    apart,
    elsewhere,
    emit,
    in_depth,
    with_bursts_in_rate,
)
from fire_atlas.effect.flakes.rounds import rounds_of
from fire_atlas.effect.flame.features import feature_vectors, refine
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.recipe.effect import Flakes
from fire_atlas.recipe.models import Recipe
from fire_atlas.vision.flow import SMALL, optical_flow, shrunk_flow, thumbnail

_SURE_SPAWNS = 5
"""If more spawns than this are expected, none at all is hardly chance, and worth a note."""


@dataclass(frozen=True, slots=True)
class Analysis:
    """Result of the analysis of a clip.

    Attributes:
        field: The recorded buoyancy field, of one round of a loop.
        glare: (frames, rows, columns) uint8, brightest channel of each cell of the field, sRGB.
        spawns: Spawns of all flakes, in all rounds.
        rounds: Number of rounds of a loop after which its flakes repeat.
    """

    field: FieldRecord
    glare: NDArray[np.uint8]
    spawns: Spawns
    rounds: int

    @classmethod
    def without_flakes(cls, field: FieldRecord) -> Self:
        """Return the analysis of a clip in which no flake is born."""
        return cls(field, np.zeros_like(field.brightness), Spawns.empty(), 1)


@dataclass(frozen=True, slots=True)
class _FrameAnalysis:
    """Result of the analysis of one frame on its own.

    Attributes:
        thumbnail: (h, w) uint8, for the optical flow.
        flow: (h, w, 2), px of the thumbnail per frame; None unless the source states motion.
        mask: (H, W) float32, confidence that each pixel is flame, 0..1.
        brightness: (rows, columns), of each cell, 0..1.
        glare: (rows, columns), brightest channel of each cell, sRGB in 0..1.
        feature_x, feature_y: (rows, columns), mean of Fv* in each cell, in units of the clip's mean
            ‖∇f‖; 0 where the optical flow drives the field.
        spawns: Flakes born in this frame, in all rounds of the clip; of a fire with depth in each
            of the places tried for them.
        is_reversed: Whether the clip runs backwards from this frame to the next.
    """

    thumbnail: Bytes
    flow: NDArray[np.float32] | None
    mask: Plane
    brightness: Plane
    glare: Plane
    feature_x: Plane
    feature_y: Plane
    spawns: tuple[Spawns, ...]
    is_reversed: bool


def analyse(
    clip: Clip, study: FlameStudy, recipe: Recipe, context: BuildContext, eddies: int = 0
) -> Analysis:
    """Find features, flow and spawns of every frame, and record the buoyancy field.

    Args:
        clip, study: The clip.
        recipe: Its recipe, with the wind as the clip's camera sees it.
        context: Workers and progress.
        eddies: Number of the eddies: those of a fire with depth are others seen from its side.
    """
    context.progress.stage("analyse", clip.count)
    analyser = FrameAnalyser.of(clip, study, recipe)
    spawns_of = dict[int, tuple[Spawns, ...]]()
    solver = solver_of(clip, study, recipe, eddies)
    glare = np.zeros((clip.count, *solver.shape), np.uint8)

    def forcings() -> Iterator[Forcing]:
        for frame in analysed_frames(clip, analyser, context):
            spawns_of[frame.number] = frame.spawns
            glare[frame.number] = np.rint(frame.glare * 255)
            context.progress.advance()
            yield frame.forcing

    solved = solve_field(forcings(), clip, solver)
    field = record_field(solved, clip, solver, has_heat=recipe.maps.haze)
    tried = zip(*(spawns_of[i] for i in range(clip.body)), strict=True)
    duration = clip.count * analyser.rounds / clip.fps if clip.loop else math.inf
    spawns = apart([Spawns.concatenate([*born]) for born in tried], clip.height, duration)
    spawns = with_bursts_in_rate(spawns, study.fires.labels, recipe.seed)
    if study.dies_out and not clip.loop and not clip.tail:
        spawns = spawns.cooled_by((clip.count - 1) / clip.fps)
    if not len(spawns.tick) and analyser.emitter.rate * clip.body / clip.fps > _SURE_SPAWNS:
        context.progress.note(
            "no flake is born: no flame in the clip moves, or features.epsilon, "
            "features.clamp or flakes.alpha is too high for its edges"
        )
    return Analysis(field, glare, spawns, analyser.rounds)


def solver_of(clip: Clip, study: FlameStudy, recipe: Recipe, eddies: int = 0) -> BuoyancySolver:
    """Return the solver of a clip's buoyancy field; see ``analyse``."""
    wind, seed = recipe.wind, recipe.seed
    return BuoyancySolver.of(recipe.buoyancy, study.buoyancy, clip, wind, seed, eddies)


def _emitter(clip: Clip, study: FlameStudy, recipe: Recipe) -> EmitterSettings:
    # Without flakes the field may still be needed, to blur the flame along it.
    flakes = recipe.flakes if recipe.flakes != "none" else Flakes(rate=0, bursts=0)
    return EmitterSettings.of(
        flakes,
        clip,
        moving_area=study.moving_area,
        fires=study.fires.by_number,
        seed=recipe.seed,
        art=study.art,
    )


def _rounds(clip: Clip, recipe: Recipe) -> int:
    """Return how many rounds of a clip its flakes are simulated for."""
    if recipe.flakes == "none":
        return 1
    in_pages = recipe.flakes.bake or recipe.maps.flakes
    return rounds_of(recipe.flakes, clip, in_pages=in_pages)


@dataclass(frozen=True, slots=True)
class AnalysedFrame:
    """Result of the analysis of one frame and the neighbour that its motion leads to.

    Attributes:
        number: Of the frame.
        spawns: Flakes born in it, in all rounds of the clip, in each of the places tried for them.
        glare: (rows, columns), brightest channel of each cell of the field, sRGB in 0..1; 0 where
            nothing ever moves.
        forcing: How it drives the velocity field.
    """

    number: int
    spawns: tuple[Spawns, ...]
    glare: Plane
    forcing: Forcing


def analysed_frames(
    clip: Clip, analyser: "FrameAnalyser", context: BuildContext
) -> Iterator[AnalysedFrame]:
    """Yield the analysis of each frame of a clip, in ``forcing_order``."""
    order, window = forcing_order(clip), analyser.window
    pairs = _pairs(context.workers.map(analyser.frame, order), clip.loop)
    size, cell = (clip.width, clip.height), analyser.recipe.buoyancy.cell
    done = context.workers.map(lambda pair: (pair[0], analyser.forcing(*pair)), pairs)
    for i, (frame, forcing) in zip(order, done, strict=True):
        yield AnalysedFrame(
            i,
            tuple(spawns.shifted(window.left, window.top) for spawns in frame.spawns),
            padded_to_grid(frame.glare, window, size, cell),
            forcing.padded(window, size, cell),
        )


def glare_of(clip: Clip, cell: int, context: BuildContext) -> NDArray[np.uint8]:
    """Return ``Analysis.glare`` of a clip whose field has cells of ``cell`` px."""

    def glare(i: int) -> Plane:
        return np.rint(cell_means(brightest_shown(clip.picture(i)), cell) * 255)

    return np.stack([*context.workers.map(glare, range(clip.count))]).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class FrameFeatures:
    """Features of one frame, in the window that is analysed. Planes are (H, W) float32.

    Attributes:
        picture: The frame, as in its file.
        brightness: 0..255.
        mask: Confidence that each pixel is flame, 0..1.
        x, y: Fv* (eq. 3).
        strength: ‖Fv*‖, by which candidates are chosen: by default only in the flame.
    """

    picture: Picture
    brightness: Plane
    mask: Plane
    x: Plane
    y: Plane
    strength: Plane


@dataclass(frozen=True, slots=True)
class FrameAnalyser:
    """Analyses single frames of a clip; its methods run in several threads.

    Attributes:
        window: The part of the frame that is analysed: where anything ever moves.
        clip, study: The clip, and what holds for all of it, cropped to the window.
        recipe: The clip's recipe.
        emitter: How flakes are spawned.
        is_small: Whether frames are so small that flow is computed at a finer scale.
        rounds: Number of rounds of the clip, each with flakes of its own.
        depth: The fire in three dimensions, if it was made so, in px of the whole frame.
    """

    window: Window
    clip: Clip
    study: FlameStudy
    recipe: Recipe
    emitter: EmitterSettings
    is_small: bool
    rounds: int
    depth: FireInDepth | None

    @classmethod
    def of(cls, clip: Clip, study: FlameStudy, recipe: Recipe) -> Self:
        """Return the analyser of a clip's frames."""
        # As in the paper, flakes may be born anywhere; otherwise only where something moves.
        everywhere = recipe.features.preset == "paper"
        whole = Window(0, 0, clip.width, clip.height)
        window = whole if everywhere else study.segmentation.active_window(recipe.buoyancy.cell)
        return cls(
            window,
            cropped(clip, window),
            study.cropped(window),
            recipe,
            _emitter(clip, study, recipe),
            is_small=clip.width * clip.height <= SMALL,
            rounds=_rounds(clip, recipe),
            depth=clip.depth,
        )

    def features(self, i: int) -> FrameFeatures:
        """Return the features of frame ``i``."""
        clip, study, features = self.clip, self.study, self.recipe.features
        picture = clip.picture(i)
        bright = brightness_of(picture, clip.blend_space)
        mask = study.segmentation.mask(bright, lambda: as_light(picture))
        fx, fy = refine(
            *feature_vectors(
                bright, features.sigma, features.kernel, study.fires.epsilon(), study.kappa
            ),
            study.buoyancy, features.beta, features.clamp,
        )  # fmt: skip
        strength = magnitude(fx, fy)
        if features.preset == "auto":
            strength = strength * mask
            if clip.burning is not None:
                strength *= clip.burning(i)  # none is born of smoke
        return FrameFeatures(picture, bright, mask, fx, fy, strength)

    def candidates(self, features: FrameFeatures) -> Candidates:
        """Return the candidates of a frame, in the window."""
        fires = replace(self.study.fires, by_number=self.emitter.fires)
        return Candidates.of(features.strength, fires, self.emitter.is_weighted)

    def frame(self, i: int) -> _FrameAnalysis:
        """Return the analysis of frame ``i`` on its own."""
        clip, study, cell = self.clip, self.study, self.recipe.buoyancy.cell
        features = self.features(i)
        small = thumbnail(features.brightness, self.is_small)
        bright = cell_means(study.segmentation.fire_of(features.brightness), cell)
        force = np.zeros_like(bright), np.zeros_like(bright)
        if self.recipe.buoyancy.motion == "features":
            unit = np.float32(1 / study.mean_gradient)
            force = cell_means(features.x, cell) * unit, cell_means(features.y, cell) * unit
        return _FrameAnalysis(
            small,
            None if clip.flow is None else shrunk_flow(clip.flow(i), small.shape, clip.fps),
            features.mask,
            bright,
            cell_means(brightest_shown(features.picture), cell),
            *force,
            self._spawns(i, features.strength) if i < clip.body else (),
            i in clip.backwards,
        )

    def _spawns(self, i: int, strength: Plane) -> tuple[Spawns, ...]:
        """Return the flakes born in frame ``i``: in each round others, by its random numbers. Of a
        fire with depth they are returned in each of the places tried for them."""
        times = [i + turn * self.clip.count for turn in range(self.rounds)]
        labels = self.study.fires.labels
        spawned = [emit(time, strength, labels, self.emitter) for time in times]
        if (depth := self.depth) is None:
            return (Spawns.concatenate(spawned),)
        left, top = self.window.left, self.window.top

        def fire_depth(x: Values, y: Values, share: Values) -> Values:
            return depth.fire_depth(i, x + left, y + top, share)

        tried = [
            in_depth(
                elsewhere(born, time, strength, labels, self.emitter),
                fire_depth,
                time,
                self.recipe.seed,
            )
            for born, time in zip(spawned, times, strict=True)
        ]
        return tuple(Spawns.concatenate([*born]) for born in zip(*tried, strict=True))

    def forcing(self, here: _FrameAnalysis, other: _FrameAnalysis, is_last: bool) -> Forcing:
        """Return the forcing of the velocity field by ``here``, given the neighbour ``other``."""
        flame = cell_means(here.mask, self.recipe.buoyancy.cell)
        if self.recipe.buoyancy.motion == "features":
            still = np.zeros_like(flame)
            return Forcing(flame, here.brightness, still, still, here.feature_x, here.feature_y)
        # The last frame continues the motion before it. Where the clip runs backwards, the flow is
        # taken forwards: hot gas always rises.
        before, after = (other, here) if is_last or here.is_reversed else (here, other)
        flow = here.flow
        if flow is None:
            flow = optical_flow(before.thumbnail, after.thumbnail, self.is_small)
        clip, cell = self.clip, self.recipe.buoyancy.cell
        u, v = flow_on_grid(flow, here.mask, (clip.width, clip.height), cell, clip.fps)
        u, v = halve_descent(u, v, self.study.buoyancy)
        return Forcing(flame, here.brightness, u, v, here.feature_x, here.feature_y)


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
