"""Animate a clip: the fire-flake effect of Kim & Lee, section III, with all its steps."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.effect.flakes.tracks import Tracks, first_frames, visible_count
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.pipeline.analyse import AnalysisSettings, analyse
from fire_atlas.pipeline.channels import measure_motion
from fire_atlas.pipeline.classify import classify
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.contribution import Contribution, FinishedAnimation
from fire_atlas.pipeline.layers import RenderSettings, SimulatedClip
from fire_atlas.pipeline.prepare import prepare
from fire_atlas.pipeline.render import render, thumbnails_of_skipped_frames
from fire_atlas.pipeline.simulate import SimulationSettings, simulate
from fire_atlas.recipe.models import Recipe
from fire_atlas.timeline.tail import shortened


def animate_views(recipe: Recipe, clips: Mapping[str, Clip], context: BuildContext) -> Contribution:
    """Animate ``clips``, by name: views of one fire from evenly spaced directions.

    The first view decides the class of the fire, so that all sides shed alike.
    """
    animations = dict[str, FinishedAnimation]()
    for name, clip in clips.items():
        is_first = not animations
        with context.timer.measure("study"):
            clip, study = prepare(recipe, clip, is_first, context)
            recipe = classify(recipe, clip, study, context) if is_first else recipe
        azimuth = 360 * len(animations) / len(clips)
        animations[name] = animate(recipe, clip, study, azimuth, context)
    statistics = {name: each.all_statistics() for name, each in animations.items()}
    figures = statistics.popitem()[1] if len(animations) == 1 else {"animations": statistics}
    return Contribution(recipe.name, animations, figures)


def animate(
    recipe: Recipe, clip: Clip, study: FlameStudy, azimuth: float, context: BuildContext
) -> FinishedAnimation:
    """Make a finished animation of a clip: analyse, simulate, render, channels.

    Args:
        recipe: The whole recipe; each step reads sections of it.
        clip: The clip as it is played.
        study: Constants of the clip.
        azimuth: Direction of the view, degrees counter-clockwise seen from above, relative to
            which the wind blows.
        context: Workers, progress and timer.
    """
    timer = context.timer
    analysis = tracks = None
    with timer.measure("analyse"):
        if recipe.has_effect:
            analysis = analyse(clip, study, AnalysisSettings.of(recipe, azimuth), context)
    with timer.measure("fly"):
        if analysis is not None and recipe.flakes != "none":
            tracks = simulate(clip, study, analysis, SimulationSettings.of(recipe), context)
            _note_flakes_left(clip, tracks, recipe.timeline.loop, context)
            clip, tracks = _without_dark_end(clip, tracks)
    simulated, settings = SimulatedClip(clip, study, analysis, tracks), RenderSettings.of(recipe)
    with timer.measure("render"):
        frames = render(simulated, settings, context)
    skipped = thumbnails_of_skipped_frames(simulated, settings, context)
    motion = measure_motion(frames, skipped, clip.loop, recipe.maps, context)
    return FinishedAnimation(
        frames=frames,
        fps=clip.fps,
        loop=clip.loop,
        foot=study.base,
        motion=motion,
        tracks=tracks,
        bakes_flakes=settings.bakes_flakes,
        pixel_art=settings.pixel_art,
        statistics=_statistics(recipe, clip, tracks),
    )


def _note_flakes_left(clip: Clip, tracks: Tracks, loop: str, context: BuildContext) -> None:
    """Note how many flakes still glow in the last frame of a clip that plays once."""
    if (
        loop == "auto"
        and not clip.loop
        and not clip.tail
        and (left := visible_count(tracks.frames[-1]))
    ):
        context.progress.note(
            f"flakes in the last frame: {left}; timeline.tail: true lets them burn out"
        )


def _without_dark_end(clip: Clip, tracks: Tracks) -> tuple[Clip, Tracks]:
    """Return clip and tracks without the last frames of a tail in which no flake is visible."""
    if not clip.tail:
        return clip, tracks
    lit = [n for n, rows in enumerate(tracks.frames) if n >= clip.body and visible_count(rows)]
    clip = shortened(clip, lit[-1] + 1 - clip.body if lit else 0)
    return clip, first_frames(tracks, clip.count)


def _statistics(recipe: Recipe, clip: Clip, tracks: Tracks | None) -> dict[str, Any]:
    statistics: dict[str, Any] = {
        "frames": clip.count,
        "frame_size": [clip.width, clip.height],
        "fps": round(clip.fps, 4),
        "matte": clip.matte,
    }
    if clip.hue_error is not None:
        statistics["blended"] = {"hue_error": round(clip.hue_error, 2)}
    if tracks is not None:
        alive = [len(rows) for rows in tracks.frames]
        statistics["flakes"] = {
            "born": len(np.unique(np.concatenate(tracks.flights))),
            "alive_mean": round(float(np.mean(alive)), 2),
            "alive_most": max(alive),
            "rounds": tracks.rounds,
        }
        flakes = recipe.flakes
        if flakes != "none" and flakes.fire_class != "auto":
            statistics["flakes"]["class"] = flakes.fire_class
    return statistics
