"""Animate a fire that a game lights and puts out: its loop, and what leads to it and from it."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import State, StateGraph, StateTransition
from fire_atlas.core.clip import Clip, FireInDepth, kept
from fire_atlas.core.context import BuildContext
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.errors import RecipeError
from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.effect.field.wind import LEVEL_SPEED, wind_velocity
from fire_atlas.effect.flakes.phase import dying_flakes, lit_flakes, passing_flakes
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.effect.flame.study import FlameStudy
from fire_atlas.effect.flame.wisp import LIGHT, Wisp
from fire_atlas.heat.less_fuel import FlameFuel
from fire_atlas.heat.ready import RampLight
from fire_atlas.pipeline.animation.animate import (
    PreparedView,
    add_flakes,
    finish,
    prepared_texture,
    prepared_views,
)
from fire_atlas.pipeline.animation.contribution import Contribution, FinishedAnimation
from fire_atlas.pipeline.animation.flame_part import parting
from fire_atlas.pipeline.animation.fly_in_depth import flies_in_depth, fly_in_depth
from fire_atlas.pipeline.animation.layers import SimulatedClip
from fire_atlas.pipeline.animation.prepare import without_veil
from fire_atlas.pipeline.animation.simulate import FlightInDepth
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.phases import NEEDS_LOOP, Phases
from fire_atlas.recipe.source import FramesSource
from fire_atlas.timeline.filmed_phases import FilmedPhases, filmed_phases
from fire_atlas.timeline.phase_change import (
    MAX_STEP,
    Exit,
    PhaseFrames,
    choose_exit,
    exit_frames,
    extinction,
    ignition,
    mixed,
)
from fire_atlas.vision.sampling import evenly_spread, frame_steps

_MEASURED = 8
"""Number of frames by which the colours of a flame are measured."""

_UPWARDS = 0.7
"""Part of the way that a fire's gas goes upwards, from which on it stands on its foot."""

_SMOKES = 0.5
"""Fuel from which on down a fire that goes out smokes."""

_SMOKE_ENDS = 0.25
"""Last part of an extinction in which its smoke is seen to go."""

_UNLIT = 0.3
"""Light of what stands in a fire when that is out, of its light in the full fire."""

BURN, IGNITE, EXTINGUISH = "burn", "ignite", "extinguish"
"""The names of the animations."""

Value = TypeVar("Value")

Draw = Callable[[int, float], Pixels]
"""``draw(i, fuel)`` returns frame i of a loop with so much of its fuel, 0..1."""


def animate_in_phases(
    recipe: Recipe,
    phases: Phases,
    clips: Mapping[str, Clip],
    cells: Sequence[Pixels],
    ramps: Mapping[str, RampLight],
    context: BuildContext,
) -> Contribution:
    """Animate a fire that loops, and how it is lit and put out, as ``phases`` say.

    ``clips`` are one view of it, by its name; ``cells`` are those of the flakes' texture, ``ramps``
    the colours of the fire, one at most.

    Raises:
        RecipeError: The fire does not loop.
    """
    filmed = None
    if isinstance(recipe.source, FramesSource):
        ((name, clip),) = clips.items()
        with context.timer.measure("study"):
            clip = without_veil(recipe, clip, context)
            filmed = filmed_phases(clip, recipe.timeline, context.workers, context.progress)
        clips = {name: filmed.loop if filmed else clip}
        # Its black has been taken off.
        source = recipe.source.model_copy(update={"black": 0})
        recipe = recipe.model_copy(update={"source": source})
    (view,) = prepared_views(recipe, clips, context)
    if not view.clip.loop:
        raise RecipeError(f"{NEEDS_LOOP}, or set timeline.loop: crossfade", key=("phases",))
    view = replace(view, recipe=view.recipe.in_one_round())
    texture = prepared_texture(view.recipe, view.clip, cells, context)
    flights = tuple[FlightInDepth, ...]()
    if flies_in_depth(view.recipe, view.clip):
        flights = fly_in_depth(view.recipe, view.clip, view.study, clips.values(), context)
    burning = add_flakes(view, flights, texture, context)
    for ramp in ramps.values():
        burning = burning.in_ramp(ramp, context)
    with context.timer.measure("study"):
        draw = drawn_with_fuel(burning, context, is_pixel_art=view.recipe.is_pixel_art)
        wisp = None if burning.is_drawn else _smoke_over(view)
        fire = _PhasedFire(burning, draw, wisp, filmed, context)
        simulated, states, figures = fire.animations(phases)
    animations = {name: finish(view.recipe, clip, context) for name, clip in simulated.items()}
    statistics = {name: animation.all_statistics() for name, animation in animations.items()}
    figures["entry_pixels"] = _entry_pixels(animations)
    statistics = {"animations": statistics, "phases": figures}
    return Contribution(recipe.name, view.recipe, animations, statistics, states, texture)


def drawn_with_fuel(burning: SimulatedClip, context: BuildContext, *, is_pixel_art: bool) -> Draw:
    """Return what draws the frames of a loop with less fuel: its flame gets smaller, and what
    stands in it darker."""
    clip, study = burning.clip, burning.study
    part = parting(clip, study.segmentation, context)
    flames = [part(i).flame for i in evenly_spread(0, clip.count - 1, _MEASURED)]
    foot, size = _foot(study)
    art = study.art if is_pixel_art else None
    flame = FlameFuel.of(flames, foot, study.buoyancy, size, is_drawn=burning.is_drawn, art=art)
    is_apart = clip.solids is not None or study.segmentation.background is not None
    # What is no flame but moves is smoke, and goes with it.
    moving = np.zeros_like(study.kappa) if is_apart else study.segmentation.activity
    unlit = 1.0 if burning.is_drawn else _UNLIT

    def draw(i: int, fuel: float) -> Pixels:
        if fuel >= 1:
            return clip.read(i)
        whole = part(i)
        rest = whole.rest * (1 - moving * np.float32(1 - fuel))[..., None]
        rest[..., :3] *= np.float32(unlit + (1 - unlit) * fuel)
        return as_plane(flame.burnt(whole.flame, fuel) + rest)

    return draw


def _smoke_over(view: PreparedView) -> Wisp | None:
    """Return the smoke over a fire that has gone out; None where pages cannot hold any, of art, and
    of fire that does not rise."""
    recipe, clip, study = view.recipe, view.clip, view.study
    is_shown = recipe.atlas.pixels == "color" and recipe.atlas.alpha != "additive"
    if not is_shown or clip.matte == "none" or study.buoyancy[1] > -_UPWARDS:
        return None
    right, _ = wind_velocity(recipe.wind, 0.0)
    return Wisp.over(
        (clip.width, clip.height),
        study.base,
        study.box.right + 1 - study.box.left,
        right * LEVEL_SPEED,
        recipe.seed,
    )


def _foot(study: FlameStudy) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the foot of a flame, px, and its size along the way it rises, and across."""
    box, (x, y) = study.box, study.buoyancy
    width, height = box.right + 1 - box.left, box.bottom + 1 - box.top
    size = abs(x) * width + abs(y) * height, abs(y) * width + abs(x) * height
    if y < -_UPWARDS:
        return study.base, size
    middle = (box.left + box.right + 1) / 2, (box.top + box.bottom + 1) / 2
    return (middle[0] - x * size[0] / 2, middle[1] - y * size[0] / 2), size


@dataclass(frozen=True, slots=True)
class _PhasedFire:
    """A loop with its flakes, what draws it with less fuel, the smoke of what has gone out, and the
    phases that its clip has."""

    burning: SimulatedClip
    draw: Draw
    wisp: Wisp | None
    filmed: FilmedPhases | None
    context: BuildContext

    def animations(
        self, phases: Phases
    ) -> tuple[dict[str, SimulatedClip], StateGraph, dict[str, Any]]:
        """Return the animations by name, how they follow one another, and figures about that."""
        loop = self.burning.clip
        found, states = {BURN: self.burning}, [State(BURN, phase="burn")]
        steps, figures = list[StateTransition](), dict[str, Any]()
        if phases.ignite != "none":
            found[IGNITE] = lit = self._lit(phases.ignite)
            states.append(State(IGNITE, following=BURN, phase="ignite"))
            steps.append(StateTransition(IGNITE, lit.clip.count - 1, BURN, 0))
        if phases.extinguish != "none":
            dying, frames = self._dying(phases.extinguish)
            found[EXTINGUISH] = dying
            states.append(State(EXTINGUISH, phase="extinguish"))
            main = int(frames.shown[0] - 1) % loop.count
            steps.append(StateTransition(BURN, main, EXTINGUISH, 0))
            exits = self._exits(frames, dying.clip, main)
            for number, chosen in enumerate(exits, 1):
                name = f"{EXTINGUISH}_{number}"
                found[name] = self._entering(chosen, frames, dying)
                states.append(State(name, following=EXTINGUISH, phase="extinguish"))
                count = len(chosen.shown)
                steps.append(StateTransition(BURN, chosen.frame, name, 0))
                steps.append(StateTransition(name, count - 1, EXTINGUISH, count))
            figures["entry_frames"] = sum(len(chosen.shown) for chosen in exits)
        return found, StateGraph(tuple(states), tuple(steps)), figures

    def _lit(self, seconds: float) -> SimulatedClip:
        """Return the fire as it is lit, in ``seconds`` or as its clip shows it."""
        loop, filmed = self.burning.clip, self.filmed
        if filmed is None or filmed.lit is None:
            frames = ignition(loop.count, _count(seconds, loop.fps))
            return self._played(frames, self._picture(frames), lit_flakes)
        count = filmed.lit.count
        frames = PhaseFrames(np.arange(-count, 0) % loop.count, filmed.lit_fuel)
        self._note_filmed(IGNITE, filmed.lit)
        return self._played(frames, filmed.lit.read, lit_flakes)

    def _dying(self, seconds: float) -> tuple[SimulatedClip, PhaseFrames]:
        """Return the fire as it goes out, in ``seconds`` or as its clip shows it."""
        loop, filmed = self.burning.clip, self.filmed
        if filmed is None or filmed.dying is None:
            frames = extinction(loop.count, _count(seconds, loop.fps))
            played = self._played(frames, self._picture(frames), dying_flakes)
            return self._smoking(played, frames), frames
        shown = (filmed.exit + 1 + np.arange(filmed.dying.count)) % loop.count
        frames = PhaseFrames(shown, filmed.dying_fuel)
        self._note_filmed(EXTINGUISH, filmed.dying)
        return self._played(frames, filmed.dying.read, dying_flakes), frames

    def _note_filmed(self, phase: str, clip: Clip) -> None:
        self.context.progress.note(
            f"{phase}: the clip's own, {clip.count / clip.fps:.2f} s; phases.{phase} is its "
            f"length for clips that do not show it"
        )

    def _exits(self, frames: PhaseFrames, dying: Clip, main: int) -> list[Exit]:
        """Return how the fire goes out after other frames of its loop than the ``main`` one."""
        loop, workers = self.burning.clip, self.context.workers
        usual, last = (float(np.median(frame_steps(clip, workers))) for clip in (loop, dying))
        exits = list(
            workers.map(
                lambda frame: choose_exit(
                    frame,
                    loop,
                    dying,
                    frames.fuel,
                    (usual, last),
                    self.draw,
                    is_drawn=self.burning.is_drawn,
                ),
                exit_frames(loop.count, loop.fps, main),
            )
        )
        worst = max((chosen.largest_step for chosen in exits), default=0.0)
        if worst > MAX_STEP:
            self.context.progress.note(
                f"{EXTINGUISH}: when it is entered, the fire changes by up to {worst:.2f} median "
                f"steps from frame to frame, and from {MAX_STEP:g} on it may be seen; more "
                f"phases.extinguish leaves more time for it"
            )
        return exits

    def _picture(self, frames: PhaseFrames) -> Callable[[int], Pixels]:
        shown, fuel = frames.shown.tolist(), frames.fuel.tolist()
        return lambda i: self.draw(shown[i], fuel[i])

    def _played(
        self,
        frames: PhaseFrames,
        picture: Callable[[int], Pixels],
        flakes: Callable[[Tracks, NDArray[np.intp], NDArray[np.float64]], Tracks],
    ) -> SimulatedClip:
        """Return what plays ``frames`` once, as ``picture`` draws them, with their ``flakes``."""
        flown = [flakes(tracks, frames.shown, frames.fuel) for tracks in self.burning.tracks]
        clip = _replayed(self.burning.clip, frames.shown, frames.fuel, picture)
        return self._simulated(clip, frames, flown)

    def _smoking(self, dying: SimulatedClip, frames: PhaseFrames) -> SimulatedClip:
        """Return a fire that goes out with a wisp of smoke over it, which is gone at its end."""
        wisp, clip = self.wisp, dying.clip
        if wisp is None:
            return dying
        begins = int(np.argmax(frames.fuel < _SMOKES))
        left = 1 - smooth_step(np.linspace(0, 1, clip.count) / _SMOKE_ENDS - (1 / _SMOKE_ENDS - 1))

        @cache
        def smoke(i: int) -> Pixels:
            cover = wisp.coverage((i - begins) / clip.fps, float(left[i]))
            return as_plane(cover[..., None] * np.array([LIGHT, LIGHT, LIGHT, 1], np.float32))

        def before(pixels: Callable[[int], Pixels]) -> Callable[[int], Pixels]:
            return lambda i: as_plane(pixels(i) * (1 - smoke(i)[..., 3:]) + smoke(i))

        def covering(plane: Callable[[int], Plane]) -> Callable[[int], Plane]:
            return lambda i: as_plane(1 - (1 - plane(i)) * (1 - smoke(i)[..., 3]))

        return replace(
            dying,
            clip=replace(
                clip,
                picture=kept(replace(clip, picture=before(clip.read))).picture,
                solids=clip.solids and before(clip.solids),
                hidden=clip.hidden and covering(clip.hidden),
            ),
        )

    def _entering(self, chosen: Exit, frames: PhaseFrames, dying: SimulatedClip) -> SimulatedClip:
        """Return what leads from a frame of the loop into a fire that is put out."""
        shown, share = chosen.shown, chosen.share
        fuel = frames.fuel[: len(shown)]

        def picture(i: int) -> Pixels:
            own = self.draw(int(shown[i]), float(fuel[i]))
            return mixed(own, dying.clip.read(i), float(share[i]))

        flown = [
            passing_flakes(tracks, shown, frames.fuel, after, share)
            for tracks, after in zip(self.burning.tracks, dying.tracks, strict=True)
        ]
        # All else than the picture is that of the fire that is more than half of it.
        nearest = np.where(share < 0.5, shown, frames.shown[: len(shown)])
        clip = _replayed(self.burning.clip, nearest, fuel, picture)
        return self._simulated(clip, PhaseFrames(nearest, fuel), flown)

    def _simulated(
        self, clip: Clip, frames: PhaseFrames, tracks: Sequence[Tracks]
    ) -> SimulatedClip:
        burning, analysis, colours = self.burning, self.burning.analysis, self.burning.recolouring
        if analysis is not None:
            analysis = replace(analysis, field=analysis.field.played(frames.shown, frames.fuel))
        if colours is not None:
            colours = replace(colours, solids=clip.solids)
        tracks = tuple(tracks)
        return replace(burning, clip=clip, analysis=analysis, tracks=tracks, recolouring=colours)


def _replayed(
    loop: Clip,
    shown: NDArray[np.intp],
    fuel: NDArray[np.float64],
    picture: Callable[[int], Pixels],
) -> Clip:
    """Return a clip that plays once what a loop has in frames ``shown`` (n,), with ``fuel`` (n,) of
    its fuel: as ``picture`` draws it."""
    numbers, shares = shown.tolist(), fuel.astype(np.float32)

    def weakened(plane: Callable[[int], Plane] | None) -> Callable[[int], Plane] | None:
        return None if plane is None else lambda i: as_plane(plane(numbers[i]) * shares[i])

    def replayed(plane: Callable[[int], Value] | None) -> Callable[[int], Value] | None:
        return None if plane is None else lambda i: plane(numbers[i])

    clip = replace(
        loop,
        count=len(numbers),
        picture=picture,
        loop=False,
        backwards=frozenset(),
        flow=None,
        skipped={},
        smoke=weakened(loop.smoke),
        solids=replayed(loop.solids),
        hidden=replayed(loop.hidden) if loop.solids is not None else weakened(loop.hidden),
        burning=replayed(loop.burning),
        depth=loop.depth and _in_depth(loop.depth, numbers),
    )
    return kept(clip)


def _in_depth(fire: FireInDepth, numbers: Sequence[int]) -> FireInDepth:
    """Return what is known in three dimensions of a clip that shows these frames of another."""
    return replace(
        fire,
        fire_depth=lambda i, x, y, share: fire.fire_depth(numbers[i], x, y, share),
        hidden=lambda i, x, y, z: fire.hidden(numbers[i], x, y, z),
        front_surface=lambda i: fire.front_surface(numbers[i]),
    )


def _count(seconds: float, fps: float) -> int:
    """Return the number of frames of a phase, at least two."""
    return max(2, round(seconds * fps))


def _entry_pixels(animations: Mapping[str, FinishedAnimation]) -> float:
    """Return the part of the pixels on pages that lead into what is put out from frames other than
    the last of the loop."""
    areas = {
        name: sum(math.prod(frame.sprites[0].image.shape[:2]) for frame in animation.frames)
        for name, animation in animations.items()
    }
    entries = sum(area for name, area in areas.items() if name.startswith(f"{EXTINGUISH}_"))
    return round(entries / max(sum(areas.values()), 1), 4)
