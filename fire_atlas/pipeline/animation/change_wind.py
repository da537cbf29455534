"""Animate one fire in several winds, and the transitions in which a game changes between them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from fire_atlas.atlas.sheet import State, StateGraph, StateTransition
from fire_atlas.core.context import BuildContext
from fire_atlas.core.fire_in_wind import FireInWind
from fire_atlas.core.pixels import Pixels, as_plane
from fire_atlas.effect.flakes.replay import cross_faded
from fire_atlas.heat.ready import RampLight
from fire_atlas.pipeline.animation.animate import (
    PreparedView,
    add_flakes,
    finish,
    in_ramps,
    prepared_texture,
)
from fire_atlas.pipeline.animation.classify import classify
from fire_atlas.pipeline.animation.contribution import Contribution
from fire_atlas.pipeline.animation.flake_texture import PreparedTexture
from fire_atlas.pipeline.animation.fly_in_depth import flies_in_depth, fly_in_depth
from fire_atlas.pipeline.animation.layers import SimulatedClip
from fire_atlas.pipeline.animation.prepare import prepare
from fire_atlas.pipeline.animation.simulate import FlightInDepth
from fire_atlas.recipe.models import Recipe
from fire_atlas.timeline.wind_change import MAX_STEP, ChosenChange, change_frames, choose_changes


def animate_in_wind(
    recipe: Recipe,
    fire: FireInWind,
    cells: Sequence[Pixels],
    ramps: Mapping[str, RampLight],
    context: BuildContext,
) -> Contribution:
    """Animate a fire in each of the winds of ``wind.levels``, and the changes between neighbours.

    Its foot stays in place when the wind changes. ``cells`` are those of the flakes' texture,
    ``ramps`` the colours of the fire, one at most.
    """
    with context.timer.measure("study"):
        changes = choose_changes(fire, context.workers)
    views = list(prepared_winds(recipe, fire, context))
    recipe, base = views[0].recipe, views[0].study.base
    texture = prepared_texture(recipe, views[0].clip, cells, context)
    loops = [_with_flakes(view, base, texture, context) for view in views]
    simulated = {view.name: loop for view, loop in zip(views, loops, strict=True)}
    simulated |= {_transition(change): _changing(loops, change) for change in changes}
    _note_large_steps(changes, context)
    animations = {
        name: finish(recipe, coloured, context)
        for name, clip in simulated.items()
        for _, coloured in in_ramps(clip, ramps, context)
    }
    statistics = {name: animation.all_statistics() for name, animation in animations.items()}
    states = _states([view.recipe.wind.level for view in views], changes)
    return Contribution(
        recipe.name, recipe, animations, {"animations": statistics}, states, texture
    )


def _with_flakes(
    view: PreparedView,
    base: tuple[float, float],
    texture: PreparedTexture | None,
    context: BuildContext,
) -> SimulatedClip:
    """Return a loop, of a fire whose foot is at ``base``, with its flakes."""
    view = replace(view, study=replace(view.study, base=base))
    recipe, clip, flights = view.recipe, view.clip, tuple[FlightInDepth, ...]()
    if flies_in_depth(recipe, clip):
        flights = fly_in_depth(recipe, clip, view.study, [clip], context)
    return add_flakes(view, flights, texture, context)


def prepared_winds(
    recipe: Recipe, fire: FireInWind, context: BuildContext
) -> Iterator[PreparedView]:
    """Prepare a loop for each wind, one after the other, with the recipe in that wind; the weakest
    decides the fire's class and its rate of flakes."""
    for k, (wind, loop) in enumerate(zip(recipe.wind.steady(), fire.loops, strict=True)):
        with context.timer.measure("study"):
            clip, study = prepare(recipe, loop, k == 0, context)
            recipe = classify(recipe, clip, study, context).in_one_round() if k == 0 else recipe
        yield PreparedView(_loop(k), recipe.model_copy(update={"wind": wind}), clip, study)


def _changing(loops: Sequence[SimulatedClip], chosen: ChosenChange) -> SimulatedClip:
    """Return the clip of a change with flakes and field, which fade from one loop to the other."""
    before, after = loops[chosen.before], loops[chosen.after]
    clip, analysis = chosen.change.clip, None
    share = chosen.change.shares
    leaving, entering = change_frames(
        chosen.start, chosen.change.entry, clip.count, before.clip.count
    )
    tracks = tuple(
        cross_faded(one, other, leaving, entering, share)
        for one, other in zip(before.tracks, after.tracks, strict=True)
    )
    if before.analysis is not None and after.analysis is not None:
        field = before.analysis.field.cross_faded(after.analysis.field, leaving, entering, share)
        analysis = replace(before.analysis, field=field)
    kappa = as_plane((before.study.kappa + after.study.kappa) / 2)
    study = replace(before.study, kappa=kappa)
    return SimulatedClip(clip, study, analysis, tracks, before.texture)


def _note_large_steps(changes: list[ChosenChange], context: BuildContext) -> None:
    """Note the change whose largest step may be seen, and what would make it smaller."""
    worst = max(changes, key=lambda change: change.largest_step)
    if worst.largest_step > MAX_STEP:
        context.progress.note(
            f"{_transition(worst)}: changes by up to {worst.largest_step:.2f} median steps from "
            f"frame to frame, and from {MAX_STEP:g} on it may be seen; levels nearer to one "
            f"another, or more timeline.frames to choose from, make that smaller"
        )


def _states(levels: Sequence[float], changes: list[ChosenChange]) -> StateGraph:
    """Return the graph of the loops and changes, by the names of their animations."""
    loops = [State(_loop(k), wind=level) for k, level in enumerate(levels)]
    between = [State(_transition(change), following=_loop(change.after)) for change in changes]
    steps = list[StateTransition]()
    for chosen in changes:
        last, entry = chosen.change.clip.count - 1, chosen.change.entry
        steps.append(StateTransition(_loop(chosen.before), chosen.start, _transition(chosen), 0))
        steps.append(StateTransition(_transition(chosen), last, _loop(chosen.after), entry))
    return StateGraph((*loops, *between), tuple(steps))


def _loop(wind: int) -> str:
    """Return the name of the loop in a wind, by its number."""
    return f"wind_{wind}"


def _transition(chosen: ChosenChange) -> str:
    """Return the name of a transition, by those of its loops."""
    return f"{_loop(chosen.before)}_{chosen.after}"
