"""Play flakes of loops again, once: some of them, or those of one loop until those of another."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Table, Tracks

_ID, _A, _AGE = (COLUMNS.index(name) for name in ("id", "a", "age"))
_T, _WRAPS = SPAWN_COLUMNS.index("t"), SPAWN_COLUMNS.index("wraps")

Opacity = Callable[[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]], NDArray[np.float64]]
"""``opacity(frame, born, flight)`` returns by how much that of each row is multiplied, (rows,): of
the number of its frame, of that in which its flake was first seen, and of its flight."""


def cross_faded(
    before: Tracks,
    after: Tracks,
    leaving: NDArray[np.intp],
    entering: NDArray[np.intp],
    share: NDArray[np.float64],
) -> Tracks:
    """Return tracks that play once and lead from one loop to another.

    All flakes fly as they do in their loop; only their opacity changes.

    Args:
        before, after: The tracks of the loops, of one round and of the same size and frame rate.
        leaving, entering: (n,) successive frames of the loops that are shown in each frame.
        share: (n,) weight of ``after`` in each frame, 0..1; that of ``before`` is the rest.
    """
    left = Replayed.of(before, leaving, lambda frame, _born, _flight: 1 - share[frame])
    entered = Replayed.of(after, entering, lambda frame, _born, _flight: share[frame])
    return played_together([left, entered], before)


@dataclass(frozen=True, slots=True)
class Replayed:
    """Flakes that are played again.

    Attributes:
        spawns: As of ``Tracks``; ids count from 0.
        frames: A table for each frame, as of ``Tracks``.
        cells: For each row of each frame, the cell of the texture that it shows; 0 without one.
    """

    spawns: Table
    frames: Sequence[Table]
    cells: Sequence[NDArray[np.int64]]

    @classmethod
    def of(cls, tracks: Tracks, shown: NDArray[np.intp], opacity: Opacity) -> Self:
        """Return the flakes of frames ``shown`` (n,), which follow one another, of a loop of one
        round or of what plays once. Those without opacity are left out."""
        tables = [tracks.frames[i] for i in shown]
        rows, frame = np.concatenate(tables), np.repeat(np.arange(len(shown)), [*map(len, tables)])
        # A flake is known by its flight and when that began: others of its id fly in other rounds.
        flight = np.concatenate([tracks.flights[i] for i in shown])
        began = np.concatenate([tracks.flight_frames[i] for i in shown])
        began = frame - began
        seen_as = opacity(frame, began, flight)
        rows[:, _A] *= seen_as
        cells = np.zeros(len(rows), np.int64)
        if tracks.texture is not None:
            cells = np.concatenate([tracks.texture.cells[i] for i in shown])
        lit = seen_as > 0
        rows, frame, flight, began, cells = (
            values[lit] for values in (rows, frame, flight, began, cells)
        )
        both = np.stack([flight, began])
        _, newest, which = np.unique(both, axis=1, return_index=True, return_inverse=True)
        spawns = tracks.spawns[np.searchsorted(tracks.spawns[:, 0], rows[newest, _ID])]
        spawns[:, 0] = np.arange(len(spawns))
        spawns[:, _T] = frame[newest] / tracks.fps - rows[newest, _AGE]
        spawns[:, _WRAPS] = 0
        rows[:, _ID] = which.reshape(-1)
        order = np.lexsort((rows[:, _ID], frame))
        bounds = np.searchsorted(frame, np.arange(1, len(shown)))
        return cls(spawns, np.split(rows[order], bounds), np.split(cells[order], bounds))


def played_together(parts: Sequence[Replayed], tracks: Tracks) -> Tracks:
    """Return the flakes of all ``parts``, which have as many frames, as tracks that play once.

    ``tracks`` are those from which they come, or such with the same size, rate and texture.
    """
    first_ids = np.cumsum([0, *(len(part.spawns) for part in parts)])
    spawns = np.concatenate([part.spawns for part in parts])
    spawns[:, 0] = np.arange(len(spawns))
    frames = list[Table]()
    for tables in zip(*(part.frames for part in parts), strict=True):
        frames.append(np.concatenate(tables))
        frames[-1][:, _ID] += np.repeat(first_ids[:-1], [*map(len, tables)])
    texture = tracks.texture
    if texture is not None:
        cells = zip(*(part.cells for part in parts), strict=True)
        texture = replace(texture, cells=tuple(np.concatenate(every) for every in cells))
    size = tracks.width, tracks.height
    return Tracks.one_shot(
        tracks.fps, size, tracks.seed, spawns, frames, tracks.hard, texture, tracks.camera
    )
