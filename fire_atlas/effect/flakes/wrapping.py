"""Flakes of a loop that outlive its end are seen at its beginning."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.effect.flakes.emission import TICK, Spawns
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS

_ID = COLUMNS.index("id")
_T, _WRAPS = SPAWN_COLUMNS.index("t"), SPAWN_COLUMNS.index("wraps")


def thinned(spawns: Spawns, most: int, count: int, fps: float, seed: int) -> Spawns:
    """Births of which at most ``most`` can be alive at once in a loop of ``count`` frames.

    Those that are left out are from all of it alike: if no more were born whenever it is full, it
    would be full where it begins and thin where it ends.
    """
    first = np.ceil(spawns.tick * (TICK * fps)).astype(np.intp)
    seen = np.ceil(spawns.life * fps).astype(np.intp)
    order = generator(seed, Stage.THINNING).permutation(len(first))

    def crowd(kept: int) -> int:
        """Most flakes of any frame, if the first ``kept`` of ``order`` are born."""
        begin, (whole, rest) = first[order[:kept]], np.divmod(seen[order[:kept]], count)
        change = np.bincount(begin % count, minlength=2 * count).astype(np.intp)
        np.subtract.at(change, begin % count + rest, 1)
        alive = np.cumsum(change)
        return int((alive[:count] + alive[count:]).max() + whole.sum())

    if len(first) == 0 or crowd(len(first)) <= most:
        return spawns
    kept, over = 0, len(first)
    while over - kept > 1:
        middle = (kept + over) // 2
        kept, over = (middle, over) if crowd(middle) <= most else (kept, middle)
    return spawns.where(np.sort(order[:kept]))


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
