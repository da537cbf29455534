"""A recipe's silk → sheets, air and intruders in heights and seconds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fire_atlas.core.errors import RecipeError
from fire_atlas.generators.silk.air import Air
from fire_atlas.generators.silk.fuel import Fuel, fuel_of
from fire_atlas.generators.silk.intruders import Body, stretched
from fire_atlas.generators.silk.mechanics import longest_step
from fire_atlas.generators.silk.mesh import Elastic, Model, Placement, build_model
from fire_atlas.generators.silk.placement import match_flames, placed
from fire_atlas.recipe.silk import Intruder, SilkSource
from fire_atlas.recipe.wind import Wind

MOST_STEPS = 6000
"""Most steps a second: more would take minutes."""

MOST_NODES = 200_000
"""Most nodes in all: forces on more would take too much memory."""

MOST_PLACES = 20_000_000
"""Most places of nodes that are recorded: 240 MB."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything that moves the sheets.

    Attributes:
        fuel: What burns.
        model: The sheets.
        air: The air around them.
        bodies: The intruders.
        rider: (sheets,) which body a sheet rides on, −1 for none.
        dt: Length of a step, s.
        steps: Steps a frame.
        fps: Frames per second.
    """

    fuel: Fuel
    model: Model
    air: Air
    bodies: tuple[Body, ...]
    rider: tuple[int, ...]
    dt: float
    steps: int
    fps: float


def build_scene(source: SilkSource, wind: Wind, seed: int, fps: float) -> Scene:
    """Set up what a recipe describes.

    Raises:
        RecipeError: It needs more nodes or more steps than can be done.
    """
    fuel = fuel_of(source.fuel, source.pressure, source.oxygen)
    bodies = tuple(_body(intruder) for intruder in source.intruders)
    placements = placed(source.sheets, seed)
    rider = [-1] * len(placements)
    for i, body in enumerate(bodies):
        if body.is_match:
            flames = match_flames(body)
            placements += flames
            rider += [i] * len(flames)
    nodes = len(placements) * source.rows * source.columns
    if nodes > MOST_NODES:
        raise RecipeError(
            f"source.sheets: {len(placements)} sheets of {source.rows} x {source.columns} are "
            f"{nodes} nodes; at most {MOST_NODES} can be moved, so "
            f"{MOST_NODES // (source.rows * source.columns)} sheets of this mesh"
        )
    model = build_model(
        placements, source.rows, source.columns, elastic(source, fuel, placements), pinned_rows=2
    )
    dt, steps = time_step(source, model, fuel, fps)
    factors = source.lift, source.gravity, source.turbulence
    air = Air.around(model.rest, fuel, wind, seed, factors)
    return Scene(fuel, model, air, bodies, tuple(rider), dt, steps, fps)


def refuse_length(scene: Scene, frames: int) -> None:
    """Refuse more ``frames`` than can be recorded.

    Raises:
        RecipeError: The sheets have too many nodes for so many.
    """
    nodes = scene.model.rest[..., 0].size
    if nodes * frames > MOST_PLACES:
        raise RecipeError(
            f"timeline.frames: {frames} frames of {nodes} nodes are more than can be kept in "
            f"memory; at most {MOST_PLACES // nodes}, or fewer or coarser sheets"
        )


def refuse_jumps(scene: Scene, duration: float) -> None:
    """Refuse a loop of ``duration`` s in which an intruder does not come back.

    Raises:
        RecipeError: One ends elsewhere than it begins.
    """
    for i, body in enumerate(scene.bodies):
        if not np.allclose(body.at(0.0), body.at(duration), rtol=0, atol=1e-6):
            raise RecipeError(
                f"source.intruders.{i}: is elsewhere after {duration:g} s, when the loop begins "
                f"anew, than at its start, so it would jump; let its keyframes lead it back by "
                f"then, or play once with timeline.loop: none"
            )


def elastic(source: SilkSource, fuel: Fuel, placements: Sequence[Placement]) -> Elastic:
    """Springs and masses of the mesh. All sheets are of one silk, as heavy as the mean of them."""
    area = sum(p.width * p.height for p in placements) / len(placements)
    mass = fuel.mass * source.mass * area / (source.rows * source.columns)
    stiff = source.stiffness
    return Elastic(
        mass,
        fuel.structural * stiff * area,
        fuel.shear * stiff * area,
        fuel.bending * stiff * area,
        fuel.damping * source.damping * mass,
    )


def time_step(source: SilkSource, model: Model, fuel: Fuel, fps: float) -> tuple[float, int]:
    """Return δt, s, and how many make a frame.

    Raises:
        RecipeError: Springs this stiff, on nodes this light, would need too many.
    """
    longest = longest_step(model, fuel.drag)
    steps = math.ceil(1 / fps / longest)
    if 1 / longest > MOST_STEPS:
        # Frequencies go with the root of stiffness over mass.
        limit = source.stiffness * (MOST_STEPS * longest) ** 2
        raise RecipeError(
            f"source.stiffness: {source.stiffness:g} at mass {source.mass:g} and a mesh of "
            f"{source.rows} x {source.columns} would swing so fast that a second takes "
            f"{1 / longest:.0f} steps; at most {MOST_STEPS} are done, so stiffness can be at most "
            f"about {limit:.3g} here; heavier or coarser sheets may be stiffer"
        )
    return 1 / fps / steps, steps


def _body(intruder: Intruder) -> Body:
    moments = [(moment.t, moment.at) for moment in intruder.keyframes]
    if intruder.at is not None:
        moments = [(0.0, intruder.at)]
    is_match = intruder.shape == "match"
    reach = {"sphere": 0.0, "log": intruder.length / 2, "match": intruder.length}[intruder.shape]
    return Body(
        times=np.array([t for t, _ in moments]),
        places=np.array([place for _, place in moments]),
        axis=stretched(reach, intruder.angle, intruder.tilt),
        centred=intruder.shape == "log",
        radius=intruder.radius,
        strength=intruder.strength,
        shown=intruder.draw,
        is_match=is_match,
    )
