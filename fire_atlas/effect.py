"""The second half of the effect: flakes fly over the recorded field and join the flame."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.analysis import Analysis
from fire_atlas.composition.blur import blur_along
from fire_atlas.composition.composite import compose
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.flakes.drawing import add_halo, draw_flakes, draw_pixels
from fire_atlas.flakes.embers import ramp
from fire_atlas.flakes.flight import Flight, Swarm, fly
from fire_atlas.flakes.rows import Appearance, rows_of, spawn_table
from fire_atlas.flakes.tracks import Tracks
from fire_atlas.flakes.wrapping import wrapped
from fire_atlas.recipe.effect import Flakes, MotionBlur
from fire_atlas.recipe.models import Recipe


def fly_flakes(
    clip: Clip, recipe: Recipe, analysis: Analysis, workers: Workers, progress: Progress
) -> Tracks:
    """Fly the flakes over the recorded field and write down what each does in every frame."""
    flakes, blur = recipe.flakes, recipe.motion_blur
    assert isinstance(flakes, Flakes), "only called for recipes with flakes"
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
    progress.stage("fly", clip.count + beyond)
    swarms = list[Swarm]()

    def flying() -> Iterator[Swarm]:
        for swarm in fly(analysis.spawns, analysis.field, clip.count + beyond, flight):
            swarms.append(swarm)
            progress.advance()
            yield swarm

    look = Appearance(
        colours=ramp(flakes.colors),
        intensity=flakes.intensity * recipe.composite.intensity,
        stretch=flakes.stretch,
        shutter=blur.shutter if isinstance(blur, MotionBlur) else 0.0,
        kappa=analysis.study.kappa,
        fades=flakes.edge == "fade",
        pixel=flakes.sprite == "pixel",
        fps=clip.fps,
    )
    frames = list(rows_of(flying(), analysis.spawns, look, workers))
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
        hard=look.pixel,
    )


@dataclass(frozen=True, slots=True)
class Layers:
    """A frame that is not joined yet.

    Attributes:
        flame: (H, W, 4) pixels, blurred if asked.
        flakes: (H, W, 3) their light on black, may exceed 1; None where nobody sees them.
        bakes: Whether they are joined with the flame.
    """

    flame: Pixels
    flakes: NDArray[np.float32] | None = None
    bakes: bool = True


def render(
    i: int, clip: Clip, recipe: Recipe, analysis: Analysis | None, tracks: Tracks | None
) -> Pixels:
    """Frame ``i`` as it goes into the atlas: flame, blurred if asked, with its flakes."""
    return join(layers(i, clip, recipe, analysis, tracks), recipe, analysis)


def layers(
    i: int, clip: Clip, recipe: Recipe, analysis: Analysis | None, tracks: Tracks | None
) -> Layers:
    """Frame ``i`` as flame and flakes."""
    pixels, blur = clip.read(i), recipe.motion_blur
    if analysis is not None and isinstance(blur, MotionBlur) and blur.flame:
        field = analysis.field
        pixels = blur_along(
            pixels, field.u[i], field.v[i], analysis.study.kappa, blur.shutter / clip.fps,
            blur.samples,
        )  # fmt: skip
    flakes = recipe.flakes
    if tracks is None or flakes == "none" or not (flakes.bake or recipe.maps.flakes):
        return Layers(pixels)
    return Layers(pixels, draw(flakes, tracks.frames[i], clip.height, clip.width), flakes.bake)


def join(parts: Layers, recipe: Recipe, analysis: Analysis | None) -> Pixels:
    """Compose a frame's layers as the recipe wants it; the flame's own array, changed."""
    if parts.flakes is None or not parts.bakes:
        return parts.flame
    return _with_flakes(parts.flame, parts.flakes, recipe, analysis)


def flakes_alone(parts: Layers, recipe: Recipe, analysis: Analysis | None) -> Pixels:
    """Return the flakes as they would be with no flame behind them."""
    empty = np.zeros_like(parts.flame)
    if parts.flakes is None:
        return empty
    return _with_flakes(empty, parts.flakes, recipe, analysis)


def _with_flakes(
    pixels: Pixels, light: NDArray[np.float32], recipe: Recipe, analysis: Analysis | None
) -> Pixels:
    palette = analysis.palette if analysis is not None else None
    blend, space = recipe.composite.blend, recipe.atlas.blend_space
    return compose(pixels, light, blend, space, palette)


def draw(flakes: Flakes, rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Flake layer (height, width, 3) of one frame as the recipe wants it."""
    if flakes.sprite == "pixel":
        return draw_pixels(rows, height, width)
    light = draw_flakes(rows, height, width)
    return add_halo(light, flakes.glow, flakes.edge == "fade") if flakes.glow > 0 else light
