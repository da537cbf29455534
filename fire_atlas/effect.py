"""The fire-flake line: what is done to a clip between its source and its atlas.

``analyse`` looks at every frame in the pool and carries the air from one to the next;
``fly_flakes`` flies the flakes over the recorded field; ``render`` makes each finished frame.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.composition.blur import blur_along
from fire_atlas.composition.composite import compose
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, brightness
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.field.air import grid_shape, still_air
from fire_atlas.field.ambient import Ambient
from fire_atlas.field.buoyancy import Drive, FieldRecord, Physics, advance
from fire_atlas.field.drive import cell_means, flow_on_grid, rising
from fire_atlas.field.eddies import Eddies
from fire_atlas.flakes.drawing import add_halo, draw_flakes, draw_pixels
from fire_atlas.flakes.embers import ramp
from fire_atlas.flakes.emission import Brood, Spawns, emit
from fire_atlas.flakes.flight import Flight, fly
from fire_atlas.flakes.rows import Appearance, rows_of, spawn_table
from fire_atlas.flakes.tracks import Tracks
from fire_atlas.flame.features import feature_vectors, refine
from fire_atlas.flame.motion import optical_flow, thumbnail
from fire_atlas.flame.palette import clip_palette
from fire_atlas.flame.study import FlameStudy, above, flame_mask, warmth
from fire_atlas.recipe.effect import Flakes, MotionBlur
from fire_atlas.recipe.models import Recipe

_SPIN_UP = 2.5
"""Seconds for which the first frame drives the air before the clip begins."""


@dataclass(frozen=True, slots=True)
class FrameLook:
    """What one frame of the clip says, before its neighbours are known.

    Attributes:
        thumb: (h, w) uint8, for the optical flow.
        mask: (H, W) float32, how surely each pixel is flame.
        lit: (rows, columns), how bright each cell is, 0..1.
        feature_x, feature_y: (rows, columns), mean Fv* of each cell in typical lengths.
        spawns: Flakes born in this frame.
    """

    thumb: Bytes
    mask: Plane
    lit: Plane
    feature_x: Plane
    feature_y: Plane
    spawns: Spawns | None


@dataclass(frozen=True, slots=True)
class Analysis:
    """What is known of a clip once all its frames were seen.

    Attributes:
        study, field: What holds for the clip, and the recorded field.
        spawns: Births of all flakes, if the recipe has any.
        palette: (colours, 3) sRGB in 0..1 that flakes are limited to, if the recipe says so.
    """

    study: FlameStudy
    field: FieldRecord
    spawns: Spawns | None
    palette: NDArray[np.float32] | None


def analyse(
    clip: Clip, recipe: Recipe, study: FlameStudy, workers: Workers, progress: Progress
) -> Analysis:
    """Find features, flow and births of every frame and record the buoyancy field."""
    progress.stage("analyse", clip.count)
    brood = _brood(clip, recipe, study)
    looks = workers.map(lambda i: _look(i, clip, recipe, study, brood), range(clip.count))
    physics = Physics.of(recipe.buoyancy, clip.height)
    shape = grid_shape(clip.width, clip.height, physics.cell)
    eddies = Eddies.random(recipe.seed, shape[0], recipe.buoyancy.turbulence * clip.height)
    ambient = Ambient(eddies, recipe.wind, clip.height)
    u = np.empty((clip.count, *shape), np.float32)
    v, lit = np.empty_like(u), np.empty(u.shape, np.uint8)
    births = []
    air, dt = still_air(shape), 1 / clip.fps
    for i, (spawns, drive) in enumerate(_drives(looks, clip, study, physics, workers)):
        for step in range(round(_SPIN_UP * clip.fps) if i == 0 else 0, 0, -1):
            air = advance(air, drive, ambient, physics, -step * dt, dt)
        air = advance(air, drive, ambient, physics, i * dt, dt)
        u[i], v[i], lit[i] = air.u, air.v, np.rint(drive.lit * 255)
        births.append(spawns)
        progress.advance()
    field = FieldRecord(u, v, lit, physics.cell, clip.fps)
    palette = clip_palette(clip, workers) if recipe.composite.palette == "clip" else None
    return Analysis(study, field, Spawns.joined([b for b in births if b is not None]), palette)


def fly_flakes(clip: Clip, recipe: Recipe, analysis: Analysis) -> Tracks:
    """Fly the flakes over the recorded field and write down what each does in every frame."""
    flakes, blur = recipe.flakes, recipe.motion_blur
    assert isinstance(flakes, Flakes), "only called for recipes with flakes"
    assert analysis.spawns is not None, "flakes were asked for, so births were recorded"
    flight = Flight(
        seed=recipe.seed,
        scatter=flakes.scatter,
        lag=flakes.lag,
        gravity=recipe.buoyancy.gravity * clip.height,
        wander=recipe.buoyancy.turbulence * clip.height,
        most=flakes.max,
        width=clip.width,
        height=clip.height,
    )
    swarms = list(fly(analysis.spawns, analysis.field, clip.count, flight))
    look = Appearance(
        colours=ramp(flakes.colors),
        intensity=flakes.intensity,
        stretch=flakes.stretch,
        shutter=blur.shutter if isinstance(blur, MotionBlur) else 0.0,
        kappa=analysis.study.kappa,
        fades=flakes.edge == "fade",
        pixel=flakes.sprite == "pixel",
        fps=clip.fps,
    )
    return Tracks(
        fps=clip.fps,
        width=clip.width,
        height=clip.height,
        loop=False,
        seed=recipe.seed,
        spawns=spawn_table(swarms, analysis.spawns),
        frames=tuple(rows_of(swarms, analysis.spawns, look)),
    )


def render(
    i: int, clip: Clip, recipe: Recipe, analysis: Analysis | None, tracks: Tracks | None
) -> Pixels:
    """Frame ``i`` as it goes into the atlas: flame, blurred if asked, with its flakes."""
    pixels, blur = clip.read(i), recipe.motion_blur
    if analysis is not None and isinstance(blur, MotionBlur) and blur.flame:
        field = analysis.field
        pixels = blur_along(
            pixels, field.u[i], field.v[i], analysis.study.kappa, blur.shutter / clip.fps,
            blur.samples,
        )  # fmt: skip
    flakes = recipe.flakes
    if tracks is None or flakes == "none" or not flakes.bake:
        return pixels
    light = draw(flakes, tracks.frames[i], clip.height, clip.width)
    light *= np.float32(recipe.composite.intensity)
    palette = analysis.palette if analysis is not None else None
    return compose(pixels, light, recipe.composite.blend, recipe.atlas.blend_space, palette)


def draw(flakes: Flakes, rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Flake layer (height, width, 3) of one frame as the recipe wants it."""
    if flakes.sprite == "pixel":
        return draw_pixels(rows, height, width)
    light = draw_flakes(rows, height, width)
    return add_halo(light, flakes.glow) if flakes.glow > 0 else light


def _brood(clip: Clip, recipe: Recipe, study: FlameStudy) -> Brood | None:
    flakes = recipe.flakes
    if not isinstance(flakes, Flakes):
        return None
    return Brood(
        seed=recipe.seed,
        rate=flakes.rate,
        bursts=flakes.bursts,
        candidates=study.candidates,
        alpha=study.alpha if flakes.alpha == "auto" else flakes.alpha,
        life=flakes.life,
        size=(flakes.size[0] * clip.height, flakes.size[1] * clip.height),
        height=clip.height,
        fps=clip.fps,
    )


def _look(i: int, clip: Clip, recipe: Recipe, study: FlameStudy, brood: Brood | None) -> FrameLook:
    """Everything a frame says on its own: runs in the pool."""
    pixels = clip.read(i)
    bright = brightness(pixels, clip.blend_space)
    warm = warmth(pixels) if study.warm_only else None
    luminous = above(bright, study.dim, study.bright)
    mask = flame_mask(luminous, warm, study.activity)
    features, cell = recipe.features, recipe.buoyancy.cell
    fx, fy = refine(
        *feature_vectors(bright, features.sigma, study.epsilon, study.kappa),
        study.buoyancy, features.beta, features.clamp,
    )  # fmt: skip
    spawns = None
    if brood is not None:
        strength = as_plane(cv2.magnitude(fx, fy))
        spawns = emit(i, strength * mask if features.preset == "auto" else strength, brood)
    unit = np.float32(1 / study.typical)
    return FrameLook(
        thumbnail(bright),
        mask,
        cell_means(as_plane(luminous), cell),
        cell_means(fx * unit, cell),
        cell_means(fy * unit, cell),
        spawns,
    )


def _drives(
    looks: Iterator[FrameLook],
    clip: Clip,
    study: FlameStudy,
    physics: Physics,
    workers: Workers,
) -> Iterator[tuple[Spawns | None, Drive]]:
    """Births and drive of every frame, once the frame that follows it is known."""
    size = clip.width, clip.height

    def drive(pair: tuple[FrameLook, FrameLook, bool]) -> tuple[Spawns | None, Drive]:
        here, other, is_last = pair
        flow = (
            optical_flow(other.thumb, here.thumb)
            if is_last  # nothing follows: go on as before
            else optical_flow(here.thumb, other.thumb)
        )
        u, v = flow_on_grid(flow, here.mask, size, physics.cell, clip.fps)
        u, v = rising(u, v, study.buoyancy)
        flame = cell_means(here.mask, physics.cell)
        return here.spawns, Drive(flame, here.lit, u, v, here.feature_x, here.feature_y)

    return workers.map(drive, _pairs(looks))


def _pairs(looks: Iterator[FrameLook]) -> Iterator[tuple[FrameLook, FrameLook, bool]]:
    """Each look with the following one; the last with the one before it."""
    previous: FrameLook | None = None
    here = next(looks)
    for following in chain(looks, [None]):
        if following is None:
            yield here, previous or here, True
        else:
            yield here, following, False
            previous, here = here, following
