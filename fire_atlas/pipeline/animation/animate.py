"""Animate a clip: the fire-flake effect of Kim & Lee, section III, with all its steps."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.context import BuildContext
from fire_atlas.core.pixels import Pixels
from fire_atlas.effect.field.wind import wind_in_view
from fire_atlas.effect.flakes.texture import TextureCells
from fire_atlas.effect.flakes.tracks import Tracks, visible_count
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.heat.ready import RampLight
from fire_atlas.maps.maker import AnimationParts
from fire_atlas.pipeline.animation.analyse import Analysis, analyse
from fire_atlas.pipeline.animation.classify import classify
from fire_atlas.pipeline.animation.contribution import (
    Contribution,
    FinishedAnimation,
    maps_of,
    with_room_for,
)
from fire_atlas.pipeline.animation.fly_in_depth import flies_in_depth, fly_in_depth
from fire_atlas.pipeline.animation.layers import SimulatedClip
from fire_atlas.pipeline.animation.prepare import prepare
from fire_atlas.pipeline.animation.render import render, skipped_flames
from fire_atlas.pipeline.animation.simulate import (
    FlightInDepth,
    recipes_of_sets,
    see_flight,
    simulate,
    without_dark_end,
)
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.source import FramesSource
from fire_atlas.vision.flat_art import ends_at_outlines, is_flat_art

if TYPE_CHECKING:
    from fire_atlas.pipeline.animation.flake_texture import PreparedTexture


@dataclass(frozen=True, slots=True)
class PreparedView:
    """A view of a fire, ready to be analysed.

    Attributes:
        name: Of its animation.
        recipe: With everything filled in that the class of the fire decides, and the wind as it
            blows in the view.
        clip: The clip as it is played.
        study: Constants of the clip.
    """

    name: str
    recipe: Recipe
    clip: Clip
    study: FlameStudy


def animate_views(
    recipe: Recipe,
    clips: Mapping[str, Clip],
    cells: Sequence[Pixels],
    ramps: Mapping[str, RampLight],
    context: BuildContext,
) -> Contribution:
    """Animate ``clips``, by name: views of one fire from evenly spaced directions.

    The first view decides the class of the fire, so that all sides shed alike. ``cells`` are those
    of the flakes' texture, which all views share. The flakes fly once for all ``ramps``, which are
    as from ``open_ramps``.
    """
    decided, texture, flights = recipe, None, tuple[FlightInDepth, ...]()
    drawn = dict[tuple[str, str], FinishedAnimation]()
    for view in prepared_views(recipe, clips, context):
        decided = view.recipe
        texture = texture or prepared_texture(view.recipe, view.clip, cells, context)
        if not flights and flies_in_depth(view.recipe, view.clip):
            flights = fly_in_depth(view.recipe, view.clip, view.study, clips.values(), context)
        simulated = add_flakes(view, flights, texture, context)
        for ramp, coloured in in_ramps(simulated, ramps, context):
            drawn[ramp, view.name] = finish(view.recipe, coloured, context)
    animations = {
        _title(ramp, name, clips): drawn[ramp, name] for ramp in ramps or ("",) for name in clips
    }
    statistics = {name: animation.all_statistics() for name, animation in animations.items()}
    figures = statistics.popitem()[1] if len(animations) == 1 else {"animations": statistics}
    return Contribution(recipe.name, decided, animations, figures, texture=texture)


def _title(ramp: str, view: str, views: Collection[str]) -> str:
    """Return the name of the animation of a view in a ramp."""
    return ramp if ramp and len(views) == 1 else f"{ramp}/{view}" if ramp else view


def in_ramps(
    simulated: SimulatedClip, ramps: Mapping[str, RampLight], context: BuildContext
) -> Iterator[tuple[str, SimulatedClip]]:
    """Yield a clip in the colours of each ramp, by its name; in its own if there is none."""
    if not ramps:
        yield "", simulated
    for name, ramp in ramps.items():
        yield name, simulated.in_ramp(ramp, context)


def prepared_texture(
    recipe: Recipe, clip: Clip, cells: Sequence[Pixels], context: BuildContext
) -> "PreparedTexture | None":
    """Return the texture of a recipe's flakes from its ``cells``; None if there are none."""
    if recipe.flakes == "none" or not cells:
        return None
    from fire_atlas.pipeline.animation.flake_texture import PreparedTexture

    return PreparedTexture.of(cells, recipe.flakes, clip, recipe.atlas, context)


def prepared_views(
    recipe: Recipe, clips: Mapping[str, Clip], context: BuildContext
) -> Iterator[PreparedView]:
    """Prepare ``clips``, views by name, one after the other; the first decides the fire's class."""
    for number, (name, clip) in enumerate(clips.items()):
        is_first = number == 0
        with context.timer.measure("study"):
            clip, study = prepare(recipe, clip, is_first, context)
            recipe = classify(recipe, clip, study, context) if is_first else recipe
        wind = wind_in_view(recipe.wind, azimuth=360 * number / len(clips))
        yield PreparedView(name, recipe.model_copy(update={"wind": wind}), clip, study)


def add_flakes(
    view: PreparedView,
    flights: Sequence[FlightInDepth],
    texture: "PreparedTexture | None",
    context: BuildContext,
) -> SimulatedClip:
    """Analyse a view and simulate its flakes, in as many sets as its recipe asks for; those of a
    fire with depth have their ``flights``."""
    recipe, clip, study = view.recipe, view.clip, view.study
    analysis, tracks, shape = None, tuple[Tracks, ...](), texture.shape if texture else None
    with context.timer.measure("analyse"):
        if not flights and recipe.has_effect:
            analysis = analyse(clip, study, recipe, context)
        elif recipe.needs_field:
            analysis = analyse(clip, study, recipe.without_flakes(), context)
    if recipe.flakes != "none":
        tracks = tuple(_flown(view, flights, analysis, shape, context))
        _note_flakes_left(clip, tracks, recipe.timeline.loop, context)
        clip, tracks = without_dark_end(clip, tracks)
    is_drawn = isinstance(recipe.source, FramesSource) and (
        is_flat_art(clip) or ends_at_outlines(clip)
    )
    return SimulatedClip(clip, study, analysis, tracks, shape, is_drawn=is_drawn)


def _flown(
    view: PreparedView,
    flights: Sequence[FlightInDepth],
    analysis: Analysis | None,
    shape: TextureCells | None,
    context: BuildContext,
) -> Iterator[Tracks]:
    """Yield each set of the flakes of a view, whose ``analysis`` is that of the first."""
    clip, study, timer, recipes = view.clip, view.study, context.timer, recipes_of_sets(view.recipe)
    if flights:
        for flight, own in zip(flights, recipes, strict=True):
            with timer.measure("fly"):
                tracks = see_flight(clip, study, flight, own, context, shape)
            yield tracks
        return
    for own in recipes:
        with timer.measure("analyse"):
            births = analysis or analyse(clip, study, own, context)
        with timer.measure("fly"):
            tracks = simulate(clip, study, births, own, context, shape)
        yield tracks
        analysis = None  # other sets have births and turbulence of their own


def finish(recipe: Recipe, simulated: SimulatedClip, context: BuildContext) -> FinishedAnimation:
    """Render the frames of a simulated clip, and measure what they hold besides colours."""
    clip = simulated.clip
    with context.timer.measure("render"):
        frames = render(simulated, recipe, context)
    analysis = simulated.analysis
    parts = AnimationParts(
        sizes=[(frame.width, frame.height) for frame in frames],
        loop=clip.loop,
        skipped=skipped_flames(simulated, recipe),
        clip=clip,
        study=simulated.study,
        field=None if analysis is None else analysis.field,
    )
    maps = maps_of(frames, parts, recipe, context)
    return FinishedAnimation(
        frames=with_room_for(maps, frames),
        fps=clip.fps,
        loop=clip.loop,
        foot=simulated.study.base,
        maps=maps,
        tracks=simulated.tracks,
        bakes_flakes=recipe.bakes_flakes,
        pixel_art=recipe.is_pixel_art,
        has_hard_edges=simulated.is_drawn,
        camera=None if clip.depth is None else clip.depth.camera,
        statistics=_statistics(recipe, clip, simulated.tracks),
    )


def _note_flakes_left(clip: Clip, sets: Sequence[Tracks], loop: str, context: BuildContext) -> None:
    """Note how many flakes, of the set with most, still glow in the last frame of a clip that plays
    once."""
    if (
        loop == "auto"
        and not clip.loop
        and not clip.tail
        and (left := max(visible_count(tracks.frames[-1]) for tracks in sets))
    ):
        context.progress.note(
            f"flakes in the last frame: {left}; timeline.tail: true lets them burn out"
        )


def _statistics(recipe: Recipe, clip: Clip, sets: Sequence[Tracks]) -> dict[str, Any]:
    statistics: dict[str, Any] = {
        "frames": clip.count,
        "frame_size": [clip.width, clip.height],
        "fps": round(clip.fps, 4),
        "matte": clip.matte,
    }
    if clip.hue_error is not None:
        statistics["blended"] = {"hue_error": round(clip.hue_error, 2)}
    if sets:
        alive = [len(rows) for tracks in sets for rows in tracks.frames]
        statistics["flakes"] = {
            "born": sum(len(np.unique(np.concatenate(tracks.flights))) for tracks in sets),
            "alive_mean": round(float(np.mean(alive)), 2),
            "alive_most": max(alive),
            "rounds": sets[0].rounds,
            **({"sets": len(sets)} if len(sets) > 1 else {}),
        }
        flakes = recipe.flakes
        if flakes != "none" and flakes.fire_class != "auto":
            statistics["flakes"] |= {"class": flakes.fire_class, "style": flakes.style}
    return statistics
