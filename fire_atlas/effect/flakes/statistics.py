"""Statistics of the flakes of a build, with the ranges in which embers look real."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import COLUMNS, Tracks

_ID, _X, _Y, _VX, _VY, _SIZE, _STRETCH = range(7)
_AGE, _LIFE = COLUMNS.index("age"), COLUMNS.index("life")

_MIN_FLAKES = 20
"""Minimum number of flakes from which their spread of sizes is judged."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One statistic, and the range in which embers look real.

    Attributes:
        name: Label shown to users.
        value: The figure.
        unit: Its unit; empty for a fraction or a count.
        low, high: Range in which it should lie; None leaves that side open.
    """

    name: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None

    @property
    def is_in_range(self) -> bool:
        """Whether the figure lies in its range."""
        return (self.low is None or self.value >= self.low) and (
            self.high is None or self.value <= self.high
        )


def flake_figures(tracks: Tracks) -> list[Figure]:
    """Return the statistics of all flakes of a build; an empty list if there are no flakes.

    The number alive is the spawn rate times the mean time for which a flake is seen. Sizes are as
    drawn: small frames widen the smallest flakes to what a pixel grid can show. If that concerns
    most flakes, no range is given for the spread of sizes.
    """
    flights = flights_of(tracks)
    if not flights:
        return []
    rows = np.concatenate(flights)
    height = tracks.height
    moved = [f for f in flights if len(f) > 1]
    rise = np.mean([f[-1, _Y] < f[0, _Y] for f in moved]) if moved else 1.0
    speed = np.hypot(rows[:, _VX], rows[:, _VY]) / height
    sizes = np.array([f[0, _SIZE] for f in flights])
    has_spread = len(flights) >= _MIN_FLAKES and np.median(sizes) > sizes.min()
    spread = (0.25, 0.7) if has_spread else (None, None)
    alive = np.array([len(frame) for frame in tracks.frames])
    streak = (rows[:, _STRETCH] - 1) * rows[:, _SIZE]
    travel = np.maximum(np.hypot(rows[:, _VX], rows[:, _VY]) / tracks.fps, 1e-9)
    return [
        Figure("born", float(len(flights))),
        Figure("born, rate", len(flights) * tracks.fps / len(tracks.frames), "a second"),
        Figure("seen for, mean", len(rows) / len(flights) / tracks.fps, "s"),
        Figure("alive, mean", float(alive.mean())),
        Figure("end higher than born", float(rise), "", 0.7),
        Figure("speed, median", float(np.median(speed)), "heights/s", 0.1, 1.5),
        Figure("size, median", float(np.median(sizes)), "px", 1.0),
        Figure(
            "size, σ of its logarithm", float(np.std(np.log(np.maximum(sizes, 1e-3)))), "", *spread
        ),
        Figure("life, median", float(np.median([f[0, _LIFE] for f in flights])), "s", 0.3, 4.0),
        Figure("streak, median", float(np.median(streak)), "px"),
        Figure("streak, of a frame's way", float(np.median(streak / travel)), "", None, 1.0),
        *_ends(flights, tracks),
    ]


def flights_of(tracks: Tracks) -> list[NDArray[np.float64]]:
    """Return all rows of each flight, (rows, 17), in the order of its frames."""
    rows, flight = np.concatenate(tracks.frames), np.concatenate(tracks.flights)
    if not len(rows):
        return []
    order = np.lexsort((np.concatenate(tracks.flight_frames), flight))
    return np.split(rows[order], np.flatnonzero(np.diff(flight[order])) + 1)


def _ends(flights: list[NDArray[np.float64]], tracks: Tracks) -> list[Figure]:
    """Return the fractions of flakes that left by the top, the sides or the bottom, or burnt out.

    Flakes that end only because the clip ends are not counted.
    """
    last = np.stack([flight[-1] for flight in flights])
    x = last[:, _X] + last[:, _VX] / tracks.fps
    y = last[:, _Y] + last[:, _VY] / tracks.fps
    margin = last[:, _SIZE]
    cooled = last[:, _AGE] + 1.5 / tracks.fps >= last[:, _LIFE]
    top = ~cooled & (y < margin)
    bottom = ~cooled & (y > tracks.height - margin)
    sides = ~cooled & ~top & ~bottom & ((x < margin) | (x > tracks.width - margin))
    decided = int((cooled | top | bottom | sides).sum())
    return [
        Figure(name, float(those.sum()) / decided)
        for name, those in (
            ("left by the top", top),
            ("left by the sides", sides),
            ("fell out of the bottom", bottom),
            ("burnt out", cooled),
        )
        if decided
    ]
