"""What one recipe brings to the pages: frames that are finished and encoded.

Usually a build has one part. Recipes that share their pages (``atlas.members``) are a part each.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fire_atlas.atlas.layout import Sprite, Strip
from fire_atlas.channels.encoding import motion_encoding
from fire_atlas.channels.evidence import spread
from fire_atlas.channels.flow import picture
from fire_atlas.channels.motion import Motion, learn_motion
from fire_atlas.core.clip import Clip
from fire_atlas.core.clock import Clock
from fire_atlas.core.errors import RecipeError, SourceError
from fire_atlas.core.picture import as_light
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.effect.composition.light import ClipLight
from fire_atlas.effect.field.buoyancy import lift_direction
from fire_atlas.effect.flakes.tracks import Tracks, first_frames, glowing
from fire_atlas.effect.flame.study import FlameStudy, study_flame
from fire_atlas.outputs.manifest import Input
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.analyse import Analysis, analyse
from fire_atlas.pipeline.effect import Layers, fly_flakes, layers
from fire_atlas.pipeline.finish import Finished, finish
from fire_atlas.recipe.effect import Flakes, MotionBlur
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Layer
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources.registry import open_source, open_sprites
from fire_atlas.sources.sprites import Sprites
from fire_atlas.timeline.arrange import arrange
from fire_atlas.timeline.memory import remembering
from fire_atlas.timeline.tail import shortened


@dataclass(frozen=True, slots=True)
class Part:
    """What one recipe brings.

    Attributes:
        name: Of the recipe.
        strips: Its animations; their sprites are those of the largest scale.
        sprites: Every frame of the strips, in order, in all scales.
        layers: The same of each layer that the recipe asks for.
        motions: How each of the strips moves, where the recipe asks for it.
        tracks: The flakes of each animation that has any, by its name.
        lights: The light of each animation, by its name, where it is asked for.
        inputs: The files it was made from.
        statistics: Figures about it.
    """

    name: str
    strips: tuple[Strip, ...]
    sprites: list[tuple[Sprite, ...]]
    layers: Mapping[Layer, list[tuple[Sprite, ...]]]
    motions: tuple[Motion, ...]
    tracks: Mapping[str, Tracks]
    lights: Mapping[str, ClipLight]
    inputs: list[Input]
    statistics: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Stage:
    """What making a part needs besides its recipe."""

    workers: Workers
    staging: Staging
    progress: Progress
    clock: Clock


def make_part(loaded: LoadedRecipe, stage: Stage) -> Part:
    """Make the frames of a recipe: those of an effect, or plain sprites where it only packs."""
    with stage.clock.measure("study"):
        opened = open_input(loaded, stage.workers)
        first = opened if isinstance(opened, Sprites) else next(iter(opened.values()))
        stage.progress.note(f"{first.matte} matte: {first.matte_reason}")
        # Hashed before they are read: what changes meanwhile is not up to date afterwards.
        inputs = list(stage.workers.map(Input.of, first.inputs))
        stage.staging.keep([*first.inputs, *loaded.tree.files])
    if isinstance(opened, Sprites):
        return _plain_part(loaded.recipe, opened, inputs, stage)
    return _effect_part(loaded.recipe, opened, inputs, stage)


def open_input(loaded: LoadedRecipe, workers: Workers) -> Mapping[str, Clip] | Sprites:
    """Open what a recipe names: a clip by name for each side it is seen from, or sprites of
    several animations or sizes if it only packs."""
    sprites = None if _needs_analysis(loaded.recipe) else open_sprites(loaded)
    return open_source(loaded, workers) if sprites is None else sprites


def _effect_part(
    recipe: Recipe, clips: Mapping[str, Clip], inputs: list[Input], stage: Stage
) -> Part:
    """Make the effect of each clip, a side of the same fire: an animation of its name."""
    made = {}
    for k, (name, clip) in enumerate(clips.items()):
        wind = recipe.wind.seen_from(360 * k / len(clips))
        seen = recipe.model_copy(update={"wind": wind})
        made[name] = _animation(name, seen, clip, stage)
    statistics = {name: each.statistics for name, each in made.items()}
    figures = statistics.popitem()[1] if len(made) == 1 else {"animations": statistics}
    return _part(recipe, made, inputs, figures)


@dataclass(frozen=True, slots=True)
class _Animation:
    """A finished clip: as a strip of its largest sprites, all of its frames, how they move, its
    flakes and its light."""

    strip: Strip
    frames: list[Finished]
    motion: Motion | None
    tracks: Tracks | None
    light: ClipLight | None
    statistics: dict[str, Any]


def _part(
    recipe: Recipe,
    made: Mapping[str, _Animation],
    inputs: list[Input],
    statistics: dict[str, Any],
) -> Part:
    """Join animations, by their names, to a part."""
    frames = [frame for each in made.values() for frame in each.frames]
    return Part(
        recipe.name,
        tuple(each.strip for each in made.values()),
        [frame.sprites for frame in frames],
        {layer: [frame.layers[layer] for frame in frames] for layer in recipe.maps.layers},
        tuple(each.motion for each in made.values() if each.motion is not None),
        {name: each.tracks for name, each in made.items() if each.tracks is not None},
        {name: each.light for name, each in made.items() if each.light is not None},
        inputs,
        statistics,
    )


def _animation(name: str, recipe: Recipe, clip: Clip, stage: Stage) -> _Animation:
    workers, progress, clock = stage.workers, stage.progress, stage.clock
    with clock.measure("study"):
        if isinstance(recipe.source, FramesSource):
            life = recipe.flakes.life[1] if isinstance(recipe.flakes, Flakes) else 0.0
            plain = recipe.flakes == "none" and recipe.motion_blur == "none"
            clip = arrange(clip, recipe.timeline, life, workers, progress, only_packs=plain)
        else:
            clip = replace(clip, picture=remembering(clip.picture, range(clip.count)))
        study = study_flame(clip, recipe.features, lift_direction(recipe.buoyancy), workers)
    with clock.measure("analyse"):
        analysis = _analysis(clip, recipe, study, workers, progress)
    with clock.measure("fly"):
        tracks = _tracks(clip, recipe, analysis, workers, progress)
        if tracks is not None and clip.tail:
            clip, tracks = _burnt_out(clip, tracks)
    with clock.measure("render"):
        frames = _finished(
            lambda i: layers(i, clip, recipe, analysis, tracks),
            range(clip.count),
            lambda parts: finish(parts, recipe, analysis, study),
            stage,
        )
    whole = tuple(frame.sprites[0] for frame in frames)
    strip = Strip(name, whole, 1000 / clip.fps, clip.loop, study.base)
    light = _light(frames, clip.fps, clip.loop)
    motion = _motion(frames, _skipped(clip, recipe, analysis, workers), clip.loop, recipe, stage)
    statistics = {**_statistics(clip, tracks), **_motion_figures(motion)}
    return _Animation(strip, frames, motion, tracks, light, statistics)


def _plain_part(recipe: Recipe, opened: Sprites, inputs: list[Input], stage: Stage) -> Part:
    """Make the part of a recipe that only packs images, of any sizes, in named animations.

    Raises:
        RecipeError: The timeline asks for what only one clip can be.
    """
    if not recipe.timeline.keeps_frames:
        raise RecipeError(
            "timeline cuts and joins the frames of one clip, but these are several animations or "
            "sizes; leave out all of it but loop: auto or none"
        )
    numbers = [i for frames in opened.animations.values() for i in frames]
    with stage.clock.measure("render"):
        finished = _finished(
            lambda i: Layers(opened.picture(i)),
            numbers,
            lambda parts: finish(parts, recipe, None, None),
            stage,
        )
    frames = dict(zip(numbers, finished, strict=True))
    loop = recipe.timeline.loop != "none"
    made = {}
    for name, played in opened.animations.items():
        shown = [frames[i] for i in played]
        strip = Strip(name, tuple(each.sprites[0] for each in shown), 1000 / opened.fps, loop, None)
        motion, light = _motion(shown, {}, loop, recipe, stage), _light(shown, opened.fps, loop)
        made[name] = _Animation(strip, shown, motion, None, light, _motion_figures(motion))
    statistics = {
        "frames": len(numbers),
        "animations": len(made),
        "fps": round(opened.fps, 4),
        "matte": opened.matte,
    }
    if recipe.maps.motion != "none":
        statistics["motions"] = {name: each.statistics for name, each in made.items()}
    return _part(recipe, made, inputs, statistics)


def _needs_analysis(recipe: Recipe) -> bool:
    """Whether a recipe does anything but pack."""
    blurs_flame = isinstance(recipe.motion_blur, MotionBlur) and recipe.motion_blur.flame
    return recipe.flakes != "none" or blurs_flame


def _analysis(
    clip: Clip, recipe: Recipe, study: FlameStudy, workers: Workers, progress: Progress
) -> Analysis | None:
    """Return what the effect needs to know, or None where a recipe only packs."""
    return analyse(clip, recipe, study, workers, progress) if _needs_analysis(recipe) else None


def _tracks(
    clip: Clip, recipe: Recipe, analysis: Analysis | None, workers: Workers, progress: Progress
) -> Tracks | None:
    """Fly the flakes, where there are any: a blurred flame is analysed without them too."""
    if analysis is None or recipe.flakes == "none":
        return None
    return fly_flakes(clip, recipe, analysis, workers, progress)


def _burnt_out(clip: Clip, tracks: Tracks) -> tuple[Clip, Tracks]:
    """Drop the frames of the tail in which no flake glows any more."""
    seen = [n for n, rows in enumerate(tracks.frames) if n >= clip.body and glowing(rows)]
    clip = shortened(clip, seen[-1] + 1 - clip.body if seen else 0)
    return clip, first_frames(tracks, clip.count)


def _finished(
    layers_of: Callable[[int], Layers],
    numbers: Sequence[int],
    finish_frame: Callable[[Layers], Finished],
    stage: Stage,
) -> list[Finished]:
    """Finish every frame in the pool."""
    stage.progress.stage("render", len(numbers))
    frames = []
    for finished in stage.workers.map(lambda i: finish_frame(layers_of(i)), numbers):
        frames.append(finished)
        stage.progress.advance()
    return frames


def _skipped(
    clip: Clip, recipe: Recipe, analysis: Analysis | None, workers: Workers
) -> dict[int, tuple[float, Bytes]]:
    """Return the flame, small, as the source shows it between some of the clip's frames, and when.

    For the motion that is asked for, where the clip has fewer frames than its source.
    """
    if recipe.maps.motion == "none":
        return {}
    between = replace(clip, picture=lambda i: clip.skipped[i].read())

    def flame(i: int) -> tuple[float, Bytes]:
        seen = layers(i, between, recipe, analysis, None).flame
        return clip.skipped[i].part, picture(as_light(seen), recipe.atlas.blend_space)

    chosen = spread(sorted(clip.skipped))
    return dict(zip(chosen, workers.map(flame, chosen), strict=True))


def _motion(
    frames: Sequence[Finished],
    skipped: Mapping[int, tuple[float, Bytes]],
    loop: bool,
    recipe: Recipe,
    stage: Stage,
) -> Motion | None:
    """Return how an animation moves, if the recipe asks for it.

    Raises:
        SourceError: Its frames differ in size, so that no place in one is a place in the next.
    """
    if recipe.maps.motion == "none":
        return None
    sizes = {(frame.width, frame.height) for frame in frames}
    if len(sizes) > 1:
        raise SourceError(
            "maps.motion: the images of an animation differ in size, and vectors lead from a place "
            "in one to a place in the next; make them one size, or leave maps.motion out"
        )
    pictures = [frame.picture for frame in frames if frame.picture is not None]
    with stage.clock.measure("motion"):
        stage.progress.stage("motion", len(frames))
        encoding = motion_encoding(recipe.maps.motion)
        return learn_motion(
            pictures, skipped, sizes.pop(), loop, encoding, stage.workers, stage.progress.advance
        )


def _motion_figures(motion: Motion | None) -> dict[str, Any]:
    if motion is None:
        return {}
    return {"motion": None if motion.proof is None else motion.proof.figures()}


def _light(frames: Sequence[Finished], fps: float, loop: bool) -> ClipLight | None:
    """Return the light of an animation, where it was measured."""
    lights = tuple(frame.light for frame in frames if frame.light is not None)
    sprites = [frame.sprites[0] for frame in frames]
    width, height = (max(s.frame_width for s in sprites), max(s.frame_height for s in sprites))
    return ClipLight(fps, width, height, loop, lights) if lights else None


def _statistics(clip: Clip, tracks: Tracks | None) -> dict[str, Any]:
    statistics: dict[str, Any] = {
        "frames": clip.count,
        "frame_size": [clip.width, clip.height],
        "fps": round(clip.fps, 4),
        "matte": clip.matte,
    }
    if tracks is not None:
        alive = [len(rows) for rows in tracks.frames]
        statistics["flakes"] = {
            "born": len(tracks.spawns),
            "alive_mean": round(float(np.mean(alive)), 2),
            "alive_most": max(alive),
        }
    return statistics
