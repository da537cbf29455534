"""Flakes of a loop that outlive its end are seen at its beginning."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import Stage, generator
from fire_atlas.effect.flakes.emission import TICK, Spawns
from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Tracks

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


def wrapped(tracks: Tracks, count: int) -> Tracks:
    """Fold tracks of one period and what flies on after it onto the ``count`` frames of a loop.

    A flake keeps its id across the end of the loop. One that is seen in as many frames as the loop
    has, or more, would meet itself; it changes its id every ``count - 1`` frames, so that an id is
    never in a frame twice, nor passed on from one flake to another in neighbouring frames.

    Args:
        tracks: Of a clip played once, with more than ``count`` frames.
        count: Frames of the loop.
    """
    frame = np.repeat(np.arange(len(tracks.frames)), [len(rows) for rows in tracks.frames])
    rows, moments = np.concatenate(tracks.frames), np.concatenate(tracks.moments)
    spawns = tracks.spawns.copy()
    spawns[:, _WRAPS] = np.isin(spawns[:, 0], rows[frame >= count, _ID])
    part = moments // max(count - 1, 1)
    step = rows[:, _ID].max(initial=0) + 1  # parts are apart from all ids
    rows[:, _ID] += part * step
    spawns = _with_parts(spawns, int(part.max(initial=0)), step, count / tracks.fps)
    order = np.lexsort((rows[:, _ID], frame % count))
    bounds = np.searchsorted(frame[order] % count, np.arange(1, count))
    return replace(
        tracks,
        loop=True,
        spawns=spawns[np.isin(spawns[:, 0], rows[:, _ID])],
        frames=tuple(np.split(rows[order], bounds)),
        flights=tuple(np.split(np.concatenate(tracks.flights)[order], bounds)),
        moments=tuple(np.split(moments[order], bounds)),
    )


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
