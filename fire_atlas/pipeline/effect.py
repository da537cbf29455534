"""The second half of the effect: flakes fly over the recorded field and join the flame."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import encode_frame, is_page_ready
from fire_atlas.core.clip import Clip
from fire_atlas.core.picture import Picture, as_light, to_light
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.effect.composition.blur import blur_along
from fire_atlas.effect.composition.composite import compose
from fire_atlas.effect.flakes.drawing import add_halo, draw_flakes, draw_pixels
from fire_atlas.effect.flakes.embers import ramp
from fire_atlas.effect.flakes.flight import Flight, Swarm, fly
from fire_atlas.effect.flakes.rows import Appearance, rows_of, spawn_table
from fire_atlas.effect.flakes.tracks import Tracks, glowing
from fire_atlas.effect.flakes.wrapping import thinned, wrapped
from fire_atlas.pipeline.analyse import Analysis
from fire_atlas.recipe.effect import Flakes, MotionBlur
from fire_atlas.recipe.models import Recipe


def fly_flakes(
    clip: Clip, recipe: Recipe, analysis: Analysis, workers: Workers, progress: Progress
) -> Tracks:
    """Fly the flakes over the recorded field and write down what each does in every frame."""
    flakes, blur = recipe.flakes, recipe.motion_blur
    assert isinstance(flakes, Flakes), "only called for recipes with flakes"
    shutter = blur.shutter if isinstance(blur, MotionBlur) else 0.0
    flight = _flight(clip, recipe, flakes, shutter)
    spawns = analysis.spawns
    if clip.loop:
        spawns = thinned(spawns, flakes.max, clip.count, clip.fps, recipe.seed)
    # A loop's flakes fly on past its end, until the last born has cooled.
    beyond = math.ceil(flakes.life[1] * clip.fps) + 1 if clip.loop else 0
    progress.stage("fly", clip.count + beyond)
    swarms = list[Swarm]()

    def flying() -> Iterator[Swarm]:
        for swarm in fly(spawns, analysis.field, clip.count + beyond, flight):
            swarms.append(swarm)
            progress.advance()
            yield swarm

    look = Appearance(
        colours=ramp(flakes.colors),
        intensity=flakes.intensity * recipe.composite.intensity,
        stretch=flakes.stretch,
        shutter=shutter,
        kappa=analysis.study.kappa,
        fades=flakes.edge == "fade",
        pixel=flakes.sprite == "pixel",
        fps=clip.fps,
    )
    frames = list(rows_of(flying(), spawns, look, workers))
    births, size = spawn_table(swarms, spawns, look.pixel), (clip.width, clip.height)
    tracks = Tracks.once(clip.fps, size, recipe.seed, births, frames, look.pixel)
    if clip.loop:
        return wrapped(tracks, clip.count)
    if recipe.timeline.loop == "auto" and not clip.tail and (left := glowing(frames[-1])):
        progress.note(f"flakes in the last frame: {left}; timeline.tail: true lets them burn out")
    return tracks


def _flight(clip: Clip, recipe: Recipe, flakes: Flakes, shutter: float) -> Flight:
    """How flakes fly in a clip, in px and s."""
    return Flight(
        seed=recipe.seed,
        scatter=flakes.scatter,
        lag=flakes.lag,
        gravity=recipe.buoyancy.gravity * clip.height,
        wander=recipe.buoyancy.turbulence * clip.height,
        # What fades is dark before it is outside.
        streak=(flakes.stretch + shutter) / clip.fps if flakes.edge == "crop" else 0.0,
        most=flakes.max,
        width=clip.width,
        height=clip.height,
    )


@dataclass(frozen=True, slots=True)
class Layers:
    """A frame that is not joined yet.

    Attributes:
        flame: (H, W, 4), as of ``Clip.picture``; blurred if asked.
        flakes: (H, W, 3) their light on black, may exceed 1; None where nobody sees them.
        bakes: Whether they are joined with the flame.
    """

    flame: Picture
    flakes: NDArray[np.float32] | None = None
    bakes: bool = True


def layers(
    i: int, clip: Clip, recipe: Recipe, analysis: Analysis | None, tracks: Tracks | None
) -> Layers:
    """Frame ``i`` as flame and flakes."""
    flame, blur = clip.picture(i), recipe.motion_blur
    if analysis is not None and isinstance(blur, MotionBlur) and blur.flame:
        field = analysis.field
        flame = blur_along(
            as_light(flame), field.u[i], field.v[i], field.cell, analysis.study.kappa,
            blur.shutter / clip.fps, blur.samples,
        )  # fmt: skip
    flakes = recipe.flakes
    if tracks is None or flakes == "none" or not (flakes.bake or recipe.maps.flakes):
        return Layers(flame)
    return Layers(flame, draw(flakes, tracks.frames[i], clip.height, clip.width), flakes.bake)


def join(parts: Layers, recipe: Recipe, analysis: Analysis | None) -> Picture:
    """Compose a frame's layers (H, W, 4) as the recipe wants it; light is changed in place."""
    if parts.flakes is None or not parts.bakes:
        return parts.flame
    return _with_flakes(parts.flame, parts.flakes, recipe, analysis)


def flakes_alone(parts: Layers, recipe: Recipe, analysis: Analysis | None) -> Picture:
    """Return the flakes as they would be with no flame behind them."""
    empty = np.zeros(parts.flame.shape, np.float32)
    if parts.flakes is None:
        return empty
    return _with_flakes(empty, parts.flakes, recipe, analysis)


def _with_flakes(
    flame: Picture, flakes: NDArray[np.float32], recipe: Recipe, analysis: Analysis | None
) -> Picture:
    """Return the flame with its flakes; only pixels that flakes touch are made anew.

    Where the page holds the flame as its file does, the others stay as they are stored.
    """
    lit = np.flatnonzero(cv2.transform(flakes, np.ones((1, 3), np.float32)) > 0)
    if not lit.size:
        return flame
    blend, space = recipe.composite.blend, recipe.atlas.blend_space
    palette = analysis.palette if analysis is not None else None
    is_ready = is_page_ready(flame, recipe.atlas)
    whole = flame.copy() if is_ready else np.ascontiguousarray(as_light(flame))
    under = to_light(_taken(whole, lit)[None])[0] if is_ready else _taken(whole, lit)
    pixels = compose(under, _taken(flakes, lit), blend, space, palette)
    pixels = encode_frame(pixels[None], "straight", space)[0] if is_ready else pixels
    # A pixel at a time: as one number each they are put several times as fast.
    number = np.uint32 if is_ready else np.complex128
    whole.view(number).reshape(-1)[lit] = pixels.view(number).reshape(-1)
    return whole


def _taken(picture: Picture, places: NDArray[np.intp]) -> Picture:
    """Return the pixels (places, channels) of a picture at ``places``, counted row by row."""
    return np.take(picture.reshape(-1, picture.shape[2]), places, axis=0)


def draw(flakes: Flakes, rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Flake layer (height, width, 3) of one frame as the recipe wants it."""
    if flakes.sprite == "pixel":
        return draw_pixels(rows, height, width)
    light = draw_flakes(rows, height, width)
    return add_halo(light, flakes.glow, flakes.edge == "fade") if flakes.glow > 0 else light
