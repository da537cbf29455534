"""Compare the flakes of a build with embers in footage, measured alike.

The ranges are those of five clips of filmed embers, and what a layer of flakes should have to pass
for one of them: what at least two clips agree on.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks
from tests.support.filmed.flight import Sightings, birth_figures, flight_figures
from tests.support.filmed.look import look_figures

Range = tuple[float | None, float | None]
"""The lowest and the highest value; None leaves that side open."""


@dataclass(frozen=True, slots=True)
class FilmedRow:
    """What one figure is in footage, and should be.

    Attributes:
        label: Its name, for the user.
        filmed: Its range in clips of filmed embers; None if it was not measured.
        target: Range in which it should lie; None if that is the filmed one. It is open on both
            sides where footage cannot judge: its fires have other speeds than ours, and the tracker
            that measured lives lost its embers.
    """

    label: str
    filmed: Range | None
    target: Range | None = None


@dataclass(frozen=True, slots=True)
class ComparedFigure:
    """A figure of a build beside footage; ``value`` is NaN where there are too few flakes."""

    row: FilmedRow
    value: float

    @property
    def is_outside(self) -> bool:
        """Whether the figure is known and outside of the range in which it should lie."""
        low, high = self.row.target or self.row.filmed or (None, None)
        return (low is not None and self.value < low) or (high is not None and self.value > high)


ROWS: Mapping[str, Mapping[str, FilmedRow]] = {
    "colour": {
        "green at 80": FilmedRow("green of a core of red 80", (24, 33), (15, 45)),
        "blue at 80": FilmedRow("blue", (7, 32), (0, 35)),
        "green at 120": FilmedRow("green of a core of red 120", (47, 51), (35, 65)),
        "blue at 120": FilmedRow("blue", (13, 41), (0, 40)),
        "green at 160": FilmedRow("green of a core of red 160", (61, 61), (47, 77)),
        "blue at 160": FilmedRow("blue", (8, 43), (5, 45)),
        "green at 200": FilmedRow("green of a core of red 200", (101, 107), (89, 119)),
        "blue at 200": FilmedRow("blue", (40, 46), (23, 63)),
        "green at 228": FilmedRow("green of a core of red 228", (156, 163), (145, 175)),
        "blue at 228": FilmedRow("blue", (75, 92), (60, 100)),
        "green at 245": FilmedRow("green of a core of red 245", (214, 216), (197, 227)),
        "blue at 245": FilmedRow("blue", (168, 179), (145, 185)),
        "without blue": FilmedRow("red > 60 without blue", None, (None, 0)),
        "yellow-white": FilmedRow("yellow-white cores", (0, 0.018), (0.01, 0.03)),
        "core spread": FilmedRow("green / red, quartiles", (0.13, 0.53), (0.12, None)),
        "rim to core": FilmedRow("green / red, rim : core", (0.31, 0.71), (None, 0.6)),
    },
    "brightness": {
        "peak": FilmedRow("peak, median", (67, 107), (70, 120)),
        "dim": FilmedRow("peak below 80", (0.33, 0.57), (0.33, 0.55)),
        "bright": FilmedRow("peak from 180", (0.13, 0.25), (0.13, 0.25)),
        "light spread": FilmedRow("light, σ of ln", (1.3, 2.6)),
        "light p95": FilmedRow("light, 95 % : median", (8, 56), (8, 15)),
        "light skew": FilmedRow("light, skew of ln", (-0.15, 0.25), (-0.2, 0.3)),
        "top light": FilmedRow("light of brightest 5 %", None, (0.32, 0.42)),
    },
    "shape": {
        "width": FilmedRow("width, % of height", (0.55, 1.25)),
        "width p95": FilmedRow("width, 95 %, % of height", (0.86, 3.9), (1.6, 2.5)),
        "width spread": FilmedRow("width, σ of ln", (0.22, 0.59), (0.25, 0.45)),
        "one width": FilmedRow("drawn at one width", None, (None, 0.15)),
        "out of focus": FilmedRow("out of focus", None, (0.05, 0.1)),
        "length": FilmedRow("length / width", (1.5, 3.9)),
        "length p90": FilmedRow("length / width, 90 %", (2.4, 12.6), (2.5, None)),
        "length, slow": FilmedRow("… at .3-.6 heights/s", (1.6, 2.3), (1.6, 2.3)),
        "length, fast": FilmedRow("… at .6-1.2 heights/s", (2.2, 3.9), (2.2, 3.9)),
        "travel": FilmedRow("length / way in a frame", (0.89, 0.96), (0.85, 1.0)),
        "halves": FilmedRow("weaker : stronger half", (0.76, 0.94), (0.75, 0.9)),
        "halo 1": FilmedRow("halo 1 width off, %", (0.04, 0.6), (0.2, 0.8)),
        "halo 1.5": FilmedRow("halo 1.5 widths off, %", (0, 0.05), (None, 0.25)),
        "halo 2.5": FilmedRow("halo 2.5 widths off, %", (0, 0), (None, 0.02)),
    },
    "life": {
        "life": FilmedRow("seen for, s", (0.37, 0.43), (None, None)),
        "life p90": FilmedRow("seen for, 90 %, s", (0.72, 1.03), (None, None)),
        "first third": FilmedRow("light in its first third", (0.5, 0.88), (0.85, 0.95)),
        "second third": FilmedRow("light in its second third", (0.78, 0.87), (0.75, 0.9)),
        "last third": FilmedRow("light in its last third", (0.41, 0.61), (0.4, 0.65)),
        "flicker": FilmedRow("flicker, σ of ln light", (0.29, 0.49), (0.35, 0.5)),
        "flicker step": FilmedRow("flicker, step of a frame", (0.22, 0.43), (0.28, 0.45)),
        "flicker Hz": FilmedRow("flicker, centroid, Hz", (3.0, 5.5), (3.0, 5.5)),
        "flicker lag": FilmedRow("flicker, frame to frame", None, (0.25, 0.45)),
    },
    "motion": {
        "speed": FilmedRow("speed, heights/s", (0.34, 0.45), (None, None)),
        "speed spread": FilmedRow("speed, σ of ln", (0.4, 0.58), (0.45, 0.6)),
        "turn": FilmedRow("turn, rad/s", (0.7, 1.4), (None, 1.5)),
        "sign changes": FilmedRow("turn changes side", (0.11, 0.21), (None, 0.22)),
        "up": FilmedRow("fly up", (0.79, 1), (None, 0.88)),
        "sideways": FilmedRow("fly sideways", (0, 0.15), (0.1, None)),
        "down": FilmedRow("fly down", (0, 0.06), (0.02, None)),
        "path": FilmedRow("path / chord", (1.0, 1.05)),
        "acceleration": FilmedRow("acceleration, heights/s²", (0.6, 1.7)),
    },
    "births": {
        "births": FilmedRow("births in .25 s, σ² : mean", (0.8, 5.6), (3, None)),
        "in sight": FilmedRow("in sight, σ² : mean", (0.8, 8.8)),
        "radial": FilmedRow("groups, radial", (0.05, 0.34), (0.3, None)),
        "burst spread": FilmedRow("groups, spread : speed", (0.38, 1.0), (0.5, None)),
    },
}
"""All figures that are compared, by section and name."""


def compare_with_filmed(tracks: Tracks) -> dict[str, list[ComparedFigure]]:
    """Return the figures of soft flakes by section, in the order of ``ROWS``."""
    seen = Sightings.of(tracks)
    values = {
        **look_figures(seen.rows, seen.measured),
        **flight_figures(seen),
        **birth_figures(tracks),
    }
    return {
        section: [ComparedFigure(row, values.get(name, float("nan"))) for name, row in rows.items()]
        for section, rows in ROWS.items()
    }


def is_hard(tracks: Tracks) -> bool:
    """Return whether flakes are hard squares, which nothing filmed is; also if there are none.

    Files do not state it, but squares have whole widths, which no soft flakes all have.
    """
    widths = np.concatenate(tracks.frames)[:, COLUMNS.index("size")]
    return bool((widths % 1 == 0).all())
