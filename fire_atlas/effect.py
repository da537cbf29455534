"""The fire-flake line: what is done to a clip between its source and its atlas.

``analyse`` looks at every frame in the pool and carries the air from one to the next;
``fly_flakes`` flies the flakes over the recorded field; ``render`` makes each finished frame.
"""

import math
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
from fire_atlas.field.buoyancy import Drive, Physics, advance
from fire_atlas.field.drive import cell_means, flow_on_grid, rising
from fire_atlas.field.eddies import Eddies
from fire_atlas.field.record import OVERLAP, FieldRecord
from fire_atlas.flakes.drawing import add_halo, draw_flakes, draw_pixels
from fire_atlas.flakes.embers import ramp
from fire_atlas.flakes.emission import Brood, Spawns, emit
from fire_atlas.flakes.flight import Flight, fly
from fire_atlas.flakes.rows import Appearance, rows_of, spawn_table
from fire_atlas.flakes.tracks import Tracks
from fire_atlas.flakes.wrapping import wrapped
from fire_atlas.flame.features import feature_vectors, refine
from fire_atlas.flame.motion import optical_flow, thumbnail
from fire_atlas.flame.palette import clip_palette
from fire_atlas.flame.study import FlameStudy, above, flame_mask, warmth
from fire_atlas.recipe.effect import Flakes, MotionBlur
from fire_atlas.recipe.models import Recipe

_SPIN_UP = 2.5
"""Seconds of air before the clip begins: a loop's last frames drive it, or the first one does."""


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
    physics = Physics.of(recipe.buoyancy, clip.height)
    shape = grid_shape(clip.width, clip.height, physics.cell)
    field = FieldRecord.blank(clip.count, shape, physics.cell, clip.fps, clip.loop)
    ambient = _ambient(clip, recipe, shape[0])
    lead = round(_SPIN_UP * clip.fps)
    order = range(-lead, clip.count + OVERLAP) if clip.loop else range(clip.count)
    looks = workers.map(lambda n: _look(n % clip.count, clip, recipe, study, brood), order)
    drives = _drives(looks, clip, study, physics, workers)
    births, air, dt = [], still_air(shape), 1 / clip.fps
    for n, (spawns, drive) in zip(order, drives, strict=True):
        if n == 0 and not clip.loop:
            for step in range(lead):
                air = advance(air, drive, ambient, physics, (step - lead) * dt, dt)
        air = advance(air, drive, ambient, physics, n * dt, dt)
        if n >= 0:
            field.write(n, air, drive.lit)
        if spawns is not None and 0 <= n < clip.count:
            births.append(spawns)
            progress.advance()
    palette = clip_palette(clip, workers) if recipe.composite.palette == "clip" else None
    return Analysis(study, field, Spawns.joined(births) if births else None, palette)


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
    # A loop's flakes fly on past its end, until the last born has cooled.
    beyond = math.ceil(flakes.life[1] * clip.fps) + 1 if clip.loop else 0
    swarms = list(fly(analysis.spawns, analysis.field, clip.count + beyond, flight))
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
    frames = rows_of(swarms, analysis.spawns, look)
    spawns = spawn_table(swarms, analysis.spawns)
    if clip.loop:
        spawns, frames = wrapped(spawns, frames, clip.count, clip.fps)
    return Tracks(
        fps=clip.fps,
        width=clip.width,
        height=clip.height,
        loop=clip.loop,
        seed=recipe.seed,
        spawns=spawns,
        frames=tuple(frames),
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


def _ambient(clip: Clip, recipe: Recipe, rows: int) -> Ambient:
    """Return the air around the fire: a loop's repeats with it."""
    speed = recipe.buoyancy.turbulence * clip.height
    period = clip.count / clip.fps if clip.loop else None
    return Ambient(Eddies.random(recipe.seed, rows, speed, period), recipe.wind, clip.height)


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
