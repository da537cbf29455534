"""Fire in several winds: small builds of it, and a game that walks its graph of states."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels
from tests.support.graph import GraphWalker, Place

LEVELS = [0, 2, 5]

SILK: dict[str, Any] = {
    "source": {
        "kind": "silk", "width": 56, "height": 64, "rows": 8, "columns": 6,
        "sheets": {"arrangement": "crossed", "count": 2, "width": 0.4, "height": 0.6},
    },
    "wind": {"levels": LEVELS},
    "timeline": {"frames": 24, "fps": 12},
}  # fmt: skip
"""A recipe that takes a few seconds to build."""


@dataclass(frozen=True)
class Walker(GraphWalker):
    """A fire in several winds."""

    @property
    def loops(self) -> list[str]:
        return [state.animation for state in self.graph.states if state.wind is not None]

    def steps_of(self, loop: str) -> list[float]:
        count = self.count(loop)
        return [self.step((loop, i), (loop, (i + 1) % count)) for i in range(count)]

    def ends_of(self, transition: str) -> tuple[str, str]:
        """Return the loops that a transition leads from and to."""
        before = next(each.before for each in self.graph.transitions if each.after == transition)
        after = next(each.after for each in self.graph.transitions if each.before == transition)
        return before, after

    def after(self, place: Place, wanted: int) -> Place:
        """Return what a game shows after a frame, when the level with index ``wanted`` is to blow:
        as `docs/pages.md` (Wind) says."""
        name, frame = place
        ways = [each for each in self.graph.transitions if each.before == name]
        if name in self.loops:
            now = self.loops.index(name)
            towards = f"{name}_{now + (1 if wanted > now else -1)}"
            ways = [each for each in ways if wanted != now and each.after == towards]
        for way in ways:
            if way.frame == frame:
                return way.after, way.entry
        return name, (frame + 1) % self.count(name)


def recipe_in(folder: Path, keys: dict[str, Any], **others: Any) -> Path:
    path = folder / "fire.yaml"
    path.write_text(json.dumps({**keys, **others}))
    return path


def lean_of(frames: list[Pixels]) -> float:
    """Return how far the light of frames leans to the right: the slope of its middle, px per px."""
    light = np.stack([frame[..., 0] for frame in frames]).mean(axis=0)
    rows: NDArray[np.intp] = np.flatnonzero(light.sum(axis=1) > 0.2 * light.sum(axis=1).max())
    columns = np.arange(light.shape[1])
    middle = (light[rows] * columns).sum(axis=1) / light[rows].sum(axis=1)
    return -float(np.polyfit(rows, middle, 1)[0])
