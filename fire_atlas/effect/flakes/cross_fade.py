"""Cross-fade the flakes of two loops: those of one go out while those of the other light up."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import COLUMNS, SPAWN_COLUMNS, Table, Tracks

_ID, _A, _AGE = (COLUMNS.index(name) for name in ("id", "a", "age"))
_T, _WRAPS = SPAWN_COLUMNS.index("t"), SPAWN_COLUMNS.index("wraps")


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
    left = _faded(before, leaving, 1 - share, first_id=0)
    entered = _faded(after, entering, share, first_id=len(left[0]))
    spawns = np.concatenate([left[0], entered[0]])
    frames = [np.concatenate(pair) for pair in zip(left[1], entered[1], strict=True)]
    size = before.width, before.height
    texture = before.texture
    if texture is not None:
        cells = zip(left[2], entered[2], strict=True)
        texture = replace(texture, cells=tuple(np.concatenate(pair) for pair in cells))
    return Tracks.one_shot(
        before.fps, size, before.seed, spawns, frames, before.hard, texture, before.camera
    )


def _faded(
    tracks: Tracks, shown: NDArray[np.intp], opacity: NDArray[np.float64], first_id: int
) -> tuple[Table, list[Table], list[NDArray[np.int64]]]:
    """Return spawns, frames and cells of the texture of the flakes in frames ``shown`` (n,) of a
    loop, each with its ``opacity`` (n,), under ids of their own from ``first_id`` on."""
    tables = [tracks.frames[i] for i in shown]
    rows, frame = np.concatenate(tables), np.repeat(np.arange(len(shown)), [*map(len, tables)])
    # A flake is known by its flight and when that began: others of its id fly in other rounds.
    flight = np.concatenate([tracks.flights[i] for i in shown])
    began = np.concatenate([tracks.flight_frames[i] for i in shown]) - frame
    both = np.stack([flight, began])
    _, newest, which = np.unique(both, axis=1, return_index=True, return_inverse=True)
    spawns = tracks.spawns[np.searchsorted(tracks.spawns[:, 0], rows[newest, _ID])]
    spawns[:, 0] = first_id + np.arange(len(spawns))
    spawns[:, _T] = frame[newest] / tracks.fps - rows[newest, _AGE]
    spawns[:, _WRAPS] = 0
    rows[:, _ID] = first_id + which.reshape(-1)
    rows[:, _A] *= opacity[frame]
    order = np.lexsort((rows[:, _ID], frame))
    bounds = np.searchsorted(frame, np.arange(1, len(shown)))
    cells = np.zeros(len(rows), np.int64)
    if tracks.texture is not None:
        cells = np.concatenate([tracks.texture.cells[i] for i in shown])
    return spawns, np.split(rows[order], bounds), np.split(cells[order], bounds)
