"""Flakes of a loop that outlive its end are seen at its beginning."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.flakes.tracks import COLUMNS, SPAWN_COLUMNS

_ID = COLUMNS.index("id")
_T, _WRAPS = SPAWN_COLUMNS.index("t"), SPAWN_COLUMNS.index("wraps")


def wrapped(
    spawns: NDArray[np.float64], rows: list[NDArray[np.float64]], count: int, fps: float
) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Fold tables of one period and what flies on after it onto the ``count`` frames of a loop.

    A flake keeps its id across the end of the loop. One that is seen in as many frames as the loop
    has, or more, would meet itself; it changes its id every ``count - 1`` frames, so that an id is
    never in a frame twice, nor passed on from one flake to another in neighbouring frames.

    Args:
        spawns: (flakes, 9) births, columns ``SPAWN_COLUMNS``, by id.
        rows: More than ``count`` tables, (flakes, 14) each, columns ``COLUMNS``.
        count: Frames of the loop.
        fps: Frames per second.
    """
    frame = np.repeat(np.arange(len(rows)), [len(table) for table in rows])
    every = np.concatenate(rows)
    _, first, owner = np.unique(every[:, _ID], return_index=True, return_inverse=True)
    late = np.unique(every[frame >= count, _ID])
    spawns = spawns.copy()
    spawns[:, _WRAPS] = np.isin(spawns[:, 0], late)
    part = (frame - frame[first][owner]) // max(count - 1, 1)
    step = every[:, _ID].max(initial=0) + 1  # parts are apart from all ids
    every[:, _ID] += part * step
    order = np.lexsort((every[:, _ID], frame % count))
    bounds = np.searchsorted(frame[order] % count, np.arange(1, count))
    spawns = _with_parts(spawns, int(part.max(initial=0)), step, count / fps)
    seen = np.isin(spawns[:, 0], every[:, _ID])
    return spawns[seen], np.split(every[order], bounds)


def _with_parts(
    spawns: NDArray[np.float64], parts: int, step: float, period: float
) -> NDArray[np.float64]:
    """Births with a further one, a period earlier each, for every part of a flake's life."""
    copies = [spawns]
    for part in range(1, parts + 1):
        again = spawns.copy()
        again[:, 0] += part * step
        again[:, _T] -= part * period
        copies.append(again)
    return np.concatenate(copies)
