"""What else a recipe could have, for its preview page to show more."""

from collections.abc import Collection
from typing import NamedTuple

from fire_atlas.atlas.sheet import AtlasSheet


class More(NamedTuple):
    """Something that a build does not have.

    Attributes:
        choice: The choice of the page that would have more with it; "" if that is none.
        key: What gives it: a key of the recipe, or a command.
        what: What it is.
    """

    choice: str
    key: str
    what: str


_WITH_MADE_FIRE = "with kind: silk or profile"

_MORE = {
    "motion": More(
        "between", "maps.motion: godot",
        "motion vectors, along which frames pass into one another (or for unity, unreal)",
    ),
    "flame": More("layer", "maps.flame: true", "the flame without its flakes"),
    "flakes": More("layer", "maps.flakes: true", "the flakes without the flame"),
    "tracks": More("flakes", "tracks: [json]", "where each flake is, to be drawn by the game"),
    "light": More("", "tracks: [light]", "the light of each frame, for a lamp in the game"),
    "ramps": More("", "composite.ramp: [campfire, soul]", "an animation in each of some colours"),
    "views": More("views", "views.count: 4", f"the fire from as many sides, {_WITH_MADE_FIRE}"),
    "wind": More("wind", "wind.levels: [0, 2, 5]", f"a slider for the wind, {_WITH_MADE_FIRE}"),
    "phases": More(
        "phase", "phases: {ignite: 1, extinguish: 1.5}",
        "a button that puts out the fire, and lights it",
    ),
    "field": More("field", "fire-atlas preview --field RECIPE", "how the fire is analysed"),
}  # fmt: skip


def more_than(sheet: AtlasSheet, had: Collection[str]) -> list[More]:
    """Return what the build of a sheet does not have: neither as a map nor among ``had``, keys of
    the table above."""
    maps = {sheet_map.kind for sheet_map in sheet.maps}
    return [more for name, more in _MORE.items() if name not in {*maps, *had}]
