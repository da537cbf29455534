"""How a fire changes in a game, as the preview page shows it: by its graph of states.

It stays in one of some places, which stand in a row: its loops by increasing wind, or out and
burning. On its way to one of them it passes all that lie in between.
"""

from dataclasses import replace
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet, Phase, Region, StateGraph
from fire_atlas.formats.atlas.texture_packer import AtlasFile

OUT = "out"
"""The name of an animation that the page adds for a fire that vanishes: it shows nothing."""

Step = tuple[str, int | None, str, int]
"""After a frame of one animation, or after any, comes a frame of another one."""


def levels_of(sheet: AtlasSheet) -> list[str]:
    """Return the winds among which the page chooses; none for fire that does not answer it."""
    return [f"{wind:g}" for wind in sheet.states.winds] if sheet.states else []


def has_phases(sheet: AtlasSheet) -> bool:
    """Return whether the fire is lit and put out."""
    return sheet.states is not None and bool(sheet.states.of_phase("burn"))


def vanishes(sheet: AtlasSheet) -> bool:
    """Return whether the fire is put out at once, so that nothing is left of it."""
    return (
        sheet.states is not None and has_phases(sheet) and not sheet.states.of_phase("extinguish")
    )


def nothing_of(frame: Region) -> Region:
    """Return a frame that shows nothing where another one is shown."""
    return replace(frame, name="nothing is drawn", width=0, height=0)


def in_playing_order(atlas: AtlasFile) -> AtlasFile:
    """Return an atlas whose fire is lit, burns and is put out, one after the other; the same of a
    fire that is not. What enters the last from other frames of the loop is left out."""
    if atlas.sheet.states is None or not has_phases(atlas.sheet):
        return atlas
    animations = {animation.name: animation for animation in atlas.sheet.animations}
    regions = {region.name: region for region in atlas.frames}
    phases: tuple[Phase, ...] = "ignite", "burn", "extinguish"
    played = [
        animations[name]
        for graph in atlas.sheet.states.of_each_variant()
        for phase in phases
        for name in graph.of_phase(phase)[:1]
    ]
    shown = tuple(regions[name] for animation in played for name in animation.frames)
    return replace(atlas, sheet=replace(atlas.sheet, animations=tuple(played), regions=shown))


def graph_data(sheet: AtlasSheet) -> list[dict[str, Any]]:
    """Return the graph of states of each variant as ``passing.js`` follows it; none for a fire
    without one.

    An animation is its number; ``OUT`` comes after those of the sheet.

    - ``places``: the animations in which the fire stays.
    - ``leads``: of each animation the place that it is or leads to, as its number among them.
    - ``levels``: the wind in each place, if the wind is what changes.
    - ``phases``: what each animation shows, if the fire is lit and put out.
    - ``out``: the animation at whose end such a fire is out.
    - ``transitions``: after ``frame`` of ``from``, or after any, comes frame ``entry`` of ``to``.
    """
    graphs = () if sheet.states is None else sheet.states.of_each_variant()
    return [_graph_data(graph, sheet) for graph in graphs]


def _graph_data(graph: StateGraph, sheet: AtlasSheet) -> dict[str, Any]:
    lengths = {animation.name: len(animation.frames) for animation in sheet.animations}
    ends = {state.animation: state.following or state.animation for state in graph.states}
    phases: dict[str, str | None] = {each.animation: each.phase for each in graph.states}
    places = [state.animation for state in graph.states if state.is_loop]
    steps: list[Step] = [
        (step.before, step.frame, step.after, step.entry) for step in graph.transitions
    ]
    if vanishes(sheet):
        lengths[OUT], ends[OUT], phases[OUT] = 1, OUT, OUT
        steps.append((places[0], None, OUT, 0))
    if has_phases(sheet):
        out, first = _ends_of(graph)
        steps.append((out, lengths[out] - 1, first, 0))
        places.insert(0, out)
    number = {name: i for i, name in enumerate(lengths)}
    return {
        "places": [number[name] for name in places],
        "leads": [places.index(ends[name]) if name in ends else None for name in lengths],
        "levels": levels_of(sheet),
        "phases": [phases.get(name) for name in lengths] if has_phases(sheet) else None,
        "out": number[places[0]] if has_phases(sheet) else None,
        "transitions": [
            {"from": number[before], "frame": frame, "to": number[after], "entry": entry}
            for before, frame, after, entry in steps
        ],
    }


def _ends_of(graph: StateGraph) -> tuple[str, str]:
    """Return the animation that ends with a fire that is out, and the one that comes after it."""
    burn, *_ = graph.of_phase("burn")
    out, first = graph.of_phase("extinguish"), graph.of_phase("ignite")
    return (out[0] if out else OUT), (first[0] if first else burn)
