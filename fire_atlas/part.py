"""What one recipe brings to the pages: frames that are finished and encoded.

Usually a build has one part. Recipes that share their pages (``atlas.members``) are a part each.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fire_atlas.analysis import Analysis, analyse
from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.atlas.layout import Sprite, Strip
from fire_atlas.clock import Clock
from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.progress import Progress
from fire_atlas.core.workers import Workers
from fire_atlas.effect import fly_flakes, render
from fire_atlas.field.buoyancy import lift_direction
from fire_atlas.flakes.tracks import Tracks
from fire_atlas.flame.study import FlameStudy, study_flame
from fire_atlas.manifest import Input
from fire_atlas.recipe.effect import MotionBlur
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe
from fire_atlas.sources.registry import open_source, open_sprites
from fire_atlas.sources.sprites import Sprites
from fire_atlas.staging import Staging
from fire_atlas.timeline.closing import arrange


@dataclass(frozen=True, slots=True)
class Part:
    """What one recipe brings.

    Attributes:
        name: Of the recipe.
        strips: Its animations; their sprites are those of the largest scale.
        sprites: Every frame of the strips, in order, in all scales.
        tracks: The flakes of each animation that has any, by its name.
        inputs: The files it was made from.
        statistics: Figures about it.
    """

    name: str
    strips: tuple[Strip, ...]
    sprites: list[tuple[Sprite, ...]]
    tracks: Mapping[str, Tracks]
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
        opened = open_input(loaded)
        stage.progress.note(f"{opened.matte} matte: {opened.matte_reason}")
        # Hashed before they are read: what changes meanwhile is not up to date afterwards.
        inputs = list(stage.workers.map(Input.of, opened.inputs))
        stage.staging.keep([*opened.inputs, *loaded.tree.files])
    if isinstance(opened, Sprites):
        return _plain_part(loaded.recipe, opened, inputs, stage)
    return _effect_part(loaded.recipe, {loaded.recipe.name: opened}, inputs, stage)


def open_input(loaded: LoadedRecipe) -> Clip | Sprites:
    """Open what a recipe names; sprites of several animations or sizes if it only packs."""
    recipe = loaded.recipe
    assert recipe.source is not None, "a part has a source"
    assert loaded.source_path is not None, "and a source has a path"
    space = recipe.atlas.blend_space
    if not _needs_analysis(recipe):
        sprites = open_sprites(recipe.source, loaded.source_path, space, recipe.name)
        if sprites is not None:
            return sprites
    return open_source(recipe.source, loaded.source_path, space)


def _effect_part(
    recipe: Recipe, clips: Mapping[str, Clip], inputs: list[Input], stage: Stage
) -> Part:
    """Make the effect of each clip: an animation of its name."""
    made = {name: _animation(name, recipe, clip, stage) for name, clip in clips.items()}
    statistics = {name: each.statistics for name, each in made.items()}
    return Part(
        recipe.name,
        tuple(each.strip for each in made.values()),
        [frame for each in made.values() for frame in each.sprites],
        {name: each.tracks for name, each in made.items() if each.tracks is not None},
        inputs,
        statistics.popitem()[1] if len(made) == 1 else {"animations": statistics},
    )


@dataclass(frozen=True, slots=True)
class _Animation:
    """A finished clip: as a strip of its largest sprites, its sprites in all scales, its flakes."""

    strip: Strip
    sprites: list[tuple[Sprite, ...]]
    tracks: Tracks | None
    statistics: dict[str, Any]


def _animation(name: str, recipe: Recipe, clip: Clip, stage: Stage) -> _Animation:
    workers, progress, clock = stage.workers, stage.progress, stage.clock
    with clock.measure("study"):
        clip = arrange(clip, recipe.timeline, workers)
        study = study_flame(clip, recipe.features, lift_direction(recipe.buoyancy), workers)
    with clock.measure("analyse"):
        analysis = _analysis(clip, recipe, study, workers, progress)
    with clock.measure("fly"):
        tracks = _tracks(clip, recipe, analysis, progress)
    with clock.measure("render"):
        sprites = _encoded(
            lambda i: render(i, clip, recipe, analysis, tracks), range(clip.count), recipe, stage
        )
    whole = tuple(each[0] for each in sprites)
    strip = Strip(name, whole, 1000 / clip.fps, clip.loop, study.base)
    return _Animation(strip, sprites, tracks, _statistics(clip, tracks))


def _plain_part(recipe: Recipe, opened: Sprites, inputs: list[Input], stage: Stage) -> Part:
    """Make the part of a recipe that only packs images, of any sizes, in named animations."""
    numbers = [i for frames in opened.animations.values() for i in frames]
    with stage.clock.measure("render"):
        sprites = _encoded(opened.read, numbers, recipe, stage)
    made = dict(zip(numbers, sprites, strict=True))
    loop = recipe.timeline.loop != "none"
    strips = tuple(
        Strip(name, tuple(made[i][0] for i in frames), 1000 / opened.fps, loop, None)
        for name, frames in opened.animations.items()
    )
    statistics = {
        "frames": len(numbers),
        "animations": len(strips),
        "fps": round(opened.fps, 4),
        "matte": opened.matte,
    }
    return Part(recipe.name, strips, sprites, {}, inputs, statistics)


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
    clip: Clip, recipe: Recipe, analysis: Analysis | None, progress: Progress
) -> Tracks | None:
    """Fly the flakes, where there are any: a blurred flame is analysed without them too."""
    if analysis is None or recipe.flakes == "none":
        return None
    return fly_flakes(clip, recipe, analysis, progress)


def _encoded(
    frame: Callable[[int], Pixels], numbers: Sequence[int], recipe: Recipe, stage: Stage
) -> list[tuple[Sprite, ...]]:
    """Render and encode every frame, in all scales, in the pool; only trimmed bytes are kept."""
    stage.progress.stage("render", len(numbers))
    sprites = []
    work: Iterable[tuple[Sprite, ...]] = stage.workers.map(
        lambda i: encode_sprites(frame(i), recipe.atlas), numbers
    )
    for finished in work:
        sprites.append(finished)
        stage.progress.advance()
    return sprites


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
