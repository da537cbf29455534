"""A fire profile: all that is learnt of a fire."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fire_atlas.generators.profile.colours import ColourTable
from fire_atlas.generators.profile.contour import Points
from fire_atlas.generators.profile.face import Face
from fire_atlas.generators.profile.grid import Grid
from fire_atlas.generators.profile.states import LeaningSet


class Spread(NamedTuple):
    """Median of something, and the 5th and 95th percentile."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: "np.typing.ArrayLike") -> "Spread":
        """Return those of a list of numbers."""
        low, median, high = np.percentile(np.asarray(values, np.float64), [5, 50, 95])
        return cls(float(median), float(low), float(high))


@dataclass(frozen=True, slots=True)
class Statistics:
    """Figures of the clip: sizes in px of its frames, lean in degrees, light 0..1 (linear), and the
    99th percentile of how much a frame differs from the one before (``measure.difference``)."""

    height: Spread
    width: Spread
    lean: Spread
    brightness: Spread
    step: float


@dataclass(frozen=True, slots=True)
class Side:
    """One clip and what was learnt of it.

    Attributes:
        fps: Frames per second of the clip.
        closed: Whether its first frame follows its last.
        threshold: Brightness above which a pixel is flame, 0..255.
        points: Six points of every frame, px.
        statistics: Figures of the clip.
        sets: The twelve leaning sets.
        face: Its detail.
    """

    fps: float
    closed: bool
    threshold: float
    points: tuple[Points, ...]
    statistics: Statistics
    sets: tuple[LeaningSet, ...]
    face: Face

    @property
    def leans(self) -> list[float]:
        """Lean of every frame, degrees."""
        return [points.lean for points in self.points]


@dataclass(frozen=True, slots=True)
class Profile:
    """A fire as it was learnt.

    Attributes:
        grid: The cells that its detail is kept in.
        rise: Speed of the flame in its intermittent zone, flame heights per second.
        pace: Speed at which the clip is played, of its own, so that the result is no more restless.
        colours: The spatial fire colour correlation table, as it is to be generated.
        learnt: The table as it was learnt; where ``colours`` differs, somebody recoloured it.
        front: What the first clip showed.
        side: What a camera at a right angle to it showed, if there was one.
    """

    grid: Grid
    rise: float
    pace: float
    colours: ColourTable
    learnt: ColourTable
    front: Side
    side: Side | None

    @property
    def sides(self) -> tuple[Side, ...]:
        """One or two."""
        return (self.front,) if self.side is None else (self.front, self.side)
