"""The light of a fire as arrays for an animated PointLight2D of Godot."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fire_atlas.atlas.sheet import StateGraph
from fire_atlas.core.pixels import linear_to_srgb
from fire_atlas.effect.composition.light import ClipLight
from fire_atlas.formats.tracks.light import light_of_frames

TEXTURE_SIDE = 256
"""Side of the lamp's texture, px: light falls off to nothing from its middle to its edge."""

_RANGE = 6.0
"""Diameter of the lamp's texture, in root mean square diameters of the fire's own light."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """The light of all animations, one after the other.

    Attributes:
        begins: Number of the first frame of each animation, and last the number of all frames.
        loops: Whether frame 0 of an animation follows its last one, 1 or 0.
        rows: For each frame its energy, 1 in the mean; colour r, g, b in the client's blend space;
            position x, y from the pivot, px of the full-size frame, y down.
        spread: Scale of the lamp's texture, at full size.
    """

    begins: list[int]
    loops: list[int]
    rows: list[tuple[float, ...]]
    spread: float


def lamp_of(
    lights: Mapping[str, ClipLight],
    pivots: Mapping[str, tuple[float, float]],
    blend_space: str,
    graph: StateGraph | None = None,
) -> Lamp:
    """Return the lamp of ``lights``; ``pivots`` has the pivot of each animation, px.

    Energies are relative to the mean of each animation; with a graph of states to that of its first
    loop, so that the lamp shines on evenly from one to the next.
    """
    loop = None if graph is None else lights[graph.first_loop]
    begins, rows, radii = [0], list[tuple[float, ...]](), list[float]()
    for name, light in lights.items():
        for frame in light_of_frames(light, loop):
            colour = np.array([frame[channel] for channel in "rgb"])
            shown = linear_to_srgb(colour) if blend_space == "srgb" else colour
            place = frame["x"] - pivots[name][0], frame["y"] - pivots[name][1]
            rows.append((frame["intensity"], *shown.tolist(), *place))
            radii.append(frame["radius"])
        begins.append(len(rows))
    spread = 2 * _RANGE * float(np.mean(radii)) / TEXTURE_SIDE
    return Lamp(begins, [int(light.loop) for light in lights.values()], rows, max(spread, 0.01))
