"""Tracks of every kind that a build can make, for the formats to write."""

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import (
    COLUMNS,
    SPAWN_COLUMNS,
    Tracks,
    first_frames,
    fold_into_loop,
)

_LONGEST = 40
"""Frames that a flake of a loop is seen in at most."""


@st.composite
def any_tracks(draw: st.DrawFn) -> Tracks:
    """Played once, with an end cut off or not, and loops longer and shorter than their flights."""
    fps = draw(st.sampled_from([8.0, 12.0, 24.0, 24000 / 1001, 60.0]))
    loop, count = draw(st.booleans()), draw(st.integers(1, 12))
    length = count + _LONGEST if loop else count
    begins = sorted(draw(st.lists(st.integers(0, count - 1), max_size=8)))
    seen = [draw(st.integers(1, _LONGEST if loop else count - first)) for first in begins]
    chance = np.random.default_rng(draw(st.integers(0, 999)))
    tables = [list[NDArray[np.float64]]() for _ in range(length)]
    spawns = []
    for flake, (first, frames) in enumerate(zip(begins, seen, strict=True)):
        born, life = first - draw(st.floats(0, 0.99)), frames + 0.5
        for n in range(first, first + frames):
            tables[n].append(_row(chance, id=flake, age=(n - born) / fps, life=life / fps))
        spawns.append(_birth(chance, id=flake, t=born / fps, life=life / fps, wraps=0))
    table = np.array(spawns).reshape(-1, len(SPAWN_COLUMNS))
    rows = [np.array(each).reshape(-1, len(COLUMNS)) for each in tables]
    tracks = Tracks.one_shot(fps, (640, 480), draw(st.integers(0, 9)), table, rows)
    return (
        fold_into_loop(tracks, count) if loop else first_frames(tracks, draw(st.integers(1, count)))
    )


def _row(chance: np.random.Generator, **known: float) -> NDArray[np.float64]:
    stated = dict(zip(COLUMNS, chance.uniform(1, 400, len(COLUMNS)), strict=True)) | known
    return np.array([stated[name] for name in COLUMNS])


def _birth(chance: np.random.Generator, **known: float) -> NDArray[np.float64]:
    stated = (
        dict(zip(SPAWN_COLUMNS, chance.uniform(1, 400, len(SPAWN_COLUMNS)), strict=True)) | known
    )
    return np.array([stated[name] for name in SPAWN_COLUMNS])


def flights_of(tracks: Tracks) -> dict[int, list[float]]:
    """Return where each flight leads, by its number: the x of its rows, moment by moment."""
    found: dict[int, dict[int, float]] = {}
    for rows in zip(tracks.frames, tracks.flights, tracks.flight_frames, strict=True):
        for row, flight, moment in zip(*rows, strict=True):
            found.setdefault(int(flight), {})[int(moment)] = float(row[COLUMNS.index("x")])
    for moments in found.values():
        assert sorted(moments) == list(range(len(moments))), "no moment is missing"
    return {flight: [x for _, x in sorted(rows.items())] for flight, rows in found.items()}
