"""The states of an Animator Controller, and what leads from one to another in a fire that is lit
and put out.

Unity asks for an exit time in the update that passes it, in each round of a loop if it is below 1,
else once. So a fire that has gone out waits in a state of its own, ``OUT``, which may be left at
any time: it would not be asked again at the end of ``extinguish``.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from fire_atlas.atlas.sheet import AtlasSheet, StateGraph, variant_title

BURNING = "Burning"
"""The Animator's parameter that says whether a fire is to burn."""

OUT = "out"
"""The state of a fire that is out, or the end of its name in one of several variants. No animation
has this name where there are phases."""

_MARGIN = 1e-3
"""Part of a frame by which a loop is left before the next one, and a later frame entered after its
beginning: else a rounded time might show a frame too many. It keeps the end of a loop below 1."""


@dataclass(frozen=True, slots=True)
class AnimatorTransition:
    """What leads from one state to another, without a time in which both are mixed.

    Attributes:
        before, after: Names of the states.
        exit_time: When the first may be left, in its rounds; None: at any time.
        offset: Where the second begins, in its rounds.
        burning: The value of ``BURNING`` that it waits for; None: it does not wait.
    """

    before: str
    after: str
    exit_time: float | None
    offset: float
    burning: bool | None


@dataclass(frozen=True, slots=True)
class AnimatorState:
    """A state and what it plays.

    Attributes:
        name: Of its animation, or ``OUT``.
        frames: Names of the frames that it shows; None: nothing is shown.
        fps: Frames per second.
        loop: Whether it begins again at its end.
        transitions: What leads from it; of several that may be taken, Unity takes the first.
    """

    name: str
    frames: tuple[str | None, ...]
    fps: float
    loop: bool
    transitions: tuple[AnimatorTransition, ...] = ()


def animator_states(sheet: AtlasSheet) -> list[AnimatorState]:
    """Return the states in which a sheet is played, first the one to begin with."""
    frames = {each.name: each.frames for each in sheet.animations}
    duration = {region.name: region.duration for region in sheet.regions}
    fps = {name: 1000 / duration[shown[0]] for name, shown in frames.items()}
    graphs = () if sheet.states is None else sheet.states.of_each_variant()
    phased = [graph for graph in graphs if graph.of_phase("burn")]
    count = {name: len(shown) for name, shown in frames.items()}
    steps = [step for graph in phased for step in _transitions(graph, count)]
    states = [
        AnimatorState(each.name, each.frames, fps[each.name], each.loop, _from(each.name, steps))
        for each in sheet.animations
    ]
    for graph in phased:
        extinguish, out = graph.of_phase("extinguish"), _out(graph)
        last = frames[extinguish[0]][-1] if extinguish else None
        states.append(AnimatorState(out, (last,), states[0].fps, False, _from(out, steps)))
    return states


def _out(graph: StateGraph) -> str:
    """Return the name of the state in which a fire is out."""
    variant = graph.states[0].variant
    return OUT if variant is None else variant_title(variant, OUT)


def _from(name: str, steps: list[AnimatorTransition]) -> tuple[AnimatorTransition, ...]:
    return tuple(step for step in steps if step.before == name)


def _transitions(graph: StateGraph, count: Mapping[str, int]) -> Iterator[AnimatorTransition]:
    """Yield all transitions of a fire that is lit and put out.

    Args:
        graph: Its animations and the steps between them.
        count: The number of frames of each animation.
    """
    burn, ignite = graph.of_phase("burn"), graph.of_phase("ignite")
    extinguish, out = graph.of_phase("extinguish"), _out(graph)
    for step in graph.transitions:
        end = step.frame + 1
        yield AnimatorTransition(
            step.before,
            step.after,
            exit_time=(end - _MARGIN if step.before in burn else end) / count[step.before],
            offset=(step.entry + _MARGIN) / count[step.after] if step.entry else 0,
            burning=False if step.before in burn else None,
        )
    if extinguish:
        yield AnimatorTransition(extinguish[0], out, exit_time=1, offset=0, burning=None)
    else:
        yield AnimatorTransition(burn[0], out, exit_time=None, offset=0, burning=False)
    yield AnimatorTransition(out, (ignite or burn)[0], exit_time=None, offset=0, burning=True)


def first_of_variants(sheet: AtlasSheet) -> list[str]:
    """Return the name of the state in which each variant of the first fire of a sheet begins; none
    of a fire that has one only."""
    if sheet.animations[0].variant is None:
        return []
    fire = sheet.animations[0].stem.rpartition("/")[0]
    begins = dict[str, str]()
    for animation in sheet.animations:
        if animation.variant is not None and animation.stem.rpartition("/")[0] == fire:
            begins.setdefault(animation.stem, animation.name)
    return list(begins.values())
