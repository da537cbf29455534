"""Learn a fire profile from one or two clips (Lee et al., III-A and III-B)."""

import itertools
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip, ProxiedClip
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.learn.detail import detail_grid, learn_detail, learn_pose
from fire_atlas.generators.profile.learn.measure import ClipMeasurements, measure_clip
from fire_atlas.generators.profile.model import (
    FLOW_CELL,
    STATE_EDGES,
    STATE_WIDTH,
    ClipStatistics,
    DetailGrid,
    DetailModel,
    LeaningSet,
    Percentiles,
    Period,
    Profile,
    Side,
    swinging,
)

_MIN_RISE, _MAX_RISE = 0.8, 4.0
"""Limits on the rise speed, flame heights per second: even in a calm flame the gas rises."""

_MIN_SET, _MIN_RUN = 10, 6
"""A leaning set with fewer frames, or none of which so many follow one another, borrows frames of
other states: fewer do not show a fire that moves."""

_BORROWED_RUN = 8
"""Number of frames, following one another, that are borrowed together to be sheared."""


def learn(
    clips: Mapping[str, ProxiedClip], workers: Workers, threshold: float | None, cells: int
) -> Profile:
    """Learn a profile from one clip, or from two filmed at a right angle to each other.

    Args:
        clips: The view from the front, then that from the right, by the name used in messages.
        workers: Pool that reads the frames.
        threshold: Brightness (0..255) above which a pixel is flame; None: chosen for each clip.
        cells: Cells in a row and in a column of the colour table; the paper has 5.

    Raises:
        SourceError: A clip does not show a single, upright flame that is not cut off.
    """
    measured = [measure_clip(clip, name, threshold, cells, workers) for name, clip in clips.items()]
    front_and_side = [proxied.clip for proxied in clips.values()]
    grid, pairs = detail_grid(measured), list(zip(front_and_side, measured, strict=True))
    sides = [_side(*pair, grid, workers) for pair in pairs]
    return Profile(
        grid=grid,
        rise_speed=_rise_speed(sides[0].detail, grid),
        front=sides[0],
        side=sides[1] if len(sides) > 1 else None,
    )


def _side(clip: Clip, measured: ClipMeasurements, grid: DetailGrid, workers: Workers) -> Side:
    pose, points, table = learn_pose(measured), measured.points, measured.colours
    return Side(
        fps=clip.fps,
        closed=measured.closed,
        threshold=measured.mask.threshold,
        points=points,
        learnt_points=points,
        leans=tuple(measured.leans.tolist()),
        statistics=ClipStatistics(
            height=Percentiles.of([flame.height for flame in points]),
            width=Percentiles.of([flame.width for flame in points]),
            lean=Percentiles.of(measured.leans),
            brightness=Percentiles.of(measured.brightness),
            step=round(measured.step, 4),
        ),
        sets=leaning_sets(measured.leans),
        colours=table,
        learnt_colours=table,
        half_width=measured.half_width / measured.height,
        pose=pose,
        detail=learn_detail(clip, measured, pose, grid, workers),
    )


def _rise_speed(detail: DetailModel, grid: DetailGrid) -> float:
    """Return the rise speed: the upper quartile of the upward flow in the intermittent zone."""
    heights = grid.heights[FLOW_CELL // 2 :: FLOW_CELL][: detail.flow.shape[1]]
    zone = (heights > 0.2) & (heights < 1.0)
    upward = -detail.flow[:, : len(heights)][:, zone, :, 1] / grid.cells_per_height
    rising = upward[upward > 0.05]
    if rising.size < 10:
        return _MIN_RISE
    return float(np.clip(np.quantile(rising, 0.75), _MIN_RISE, _MAX_RISE))


def leaning_sets(leans: NDArray[np.float64]) -> tuple[LeaningSet, ...]:
    """Sort frames into twelve sets by their lean (frames,) in degrees: six states in two periods.

    The paper has twelve sets, "each captured in one period of time", and does not define the
    periods. Here they are what its state machine needs: the fire swings when a force sets in and
    rests when it is sustained. If the clip has too few frames for a set, it has those of its state
    in both periods; if these are too few, it borrows frames of the opposite state, to be mirrored,
    or else runs of the most similar lean, to be sheared.
    """
    swings = swinging(leans)
    periods: dict[Period, NDArray[np.bool_]] = {"swing": swings, "rest": ~swings}
    return tuple(
        _leaning_set(leans, belongs, period, low, high)
        for low, high in itertools.pairwise(STATE_EDGES)
        for period, belongs in periods.items()
    )


def _leaning_set(
    leans: NDArray[np.float64], belongs: NDArray[np.bool_], period: Period, low: float, high: float
) -> LeaningSet:
    shown, opposite = (
        _of_period(_within(signed_leans, low, high), belongs) for signed_leans in (leans, -leans)
    )
    if _is_enough(shown):
        return LeaningSet(low, high, period, "own", 0.0, tuple(map(int, shown)))
    if not belongs[shown].any() and _is_enough(opposite):
        return LeaningSet(low, high, period, "mirrored", 0.0, tuple(map(int, opposite)))
    borrowed = _nearest_runs(leans, belongs, shown, (low + high) / 2)
    shear = round((low + high) / 2 - float(leans[list(borrowed)].mean()), 2)
    return LeaningSet(low, high, period, "sheared", shear, borrowed)


def _of_period(state: NDArray[np.bool_], belongs: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the frames of a state that belong to a period; of both periods if these are few."""
    own = np.flatnonzero(state & belongs)
    return own if _is_enough(own) else np.flatnonzero(state)


def _is_enough(frames: NDArray[np.intp]) -> bool:
    """Return whether ascending frames are many, and some of them follow one another."""
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return frames.size >= _MIN_SET and max(map(len, runs)) >= _MIN_RUN


def _nearest_runs(
    leans: NDArray[np.float64],
    belongs: NDArray[np.bool_],
    own: NDArray[np.intp],
    middle: float,
) -> tuple[int, ...]:
    """Return the frames ``own`` and those of the runs whose mean lean is nearest to ``middle``, of
    the same period where possible: at least two runs, and a quarter of the clip."""
    count = len(leans)
    length = min(_BORROWED_RUN, count)
    enough = min(max(2 * length, count // 4), count)
    distance = np.abs(leans - middle) + np.where(belongs, 0.0, STATE_WIDTH)
    mean_distance = np.convolve(distance, np.ones(length) / length, "valid")
    taken = set(map(int, own))
    for first in np.argsort(mean_distance, kind="stable"):
        taken.update(range(int(first), int(first) + length))
        if len(taken) >= enough:
            break
    return tuple(sorted(taken))


def _within(leans: NDArray[np.float64], low: float, high: float) -> NDArray[np.bool_]:
    """Return which leans are in a state; the outermost states have no outer limit."""
    return ((leans >= low) | (low == STATE_EDGES[0])) & ((leans < high) | (high == STATE_EDGES[-1]))
