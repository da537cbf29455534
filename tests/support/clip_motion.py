"""How well flakes move with the flame of their clip, and how they fill the plume above it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.effect.field.forcing import cell_means, grid_shape
from fire_atlas.effect.flakes.emission import EMBER
from tests.support.effect import KIND, VX, VY, Array, EffectRun, Plane, X, Y, pixel_of

Flow = NDArray[np.float32]
"""(H, W, 2), px a frame."""

FLAME, DARK = 60.0, 10.0
"""Brightness above which a pixel is flame, and below which it is plume."""

MOVES = 0.5
"""Flow slower than this, px a frame, is noise."""

CELLS = 20
"""Cells along each side of the frame in which the plume's rows are counted."""


def dis_flow(clip: Clip, i: int) -> Flow:
    """Flow from frame ``i`` to the next by dense inverse search, at full resolution."""
    estimator = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    before, after = _pair(clip, i)
    flow = np.zeros((*before.shape, 2), np.float32)
    return np.asarray(estimator.calc(before, after, flow), np.float32)


def other_flow(clip: Clip, i: int) -> Flow:
    """Flow from frame ``i`` to the next by methods that the effect does not use: their median.

    Fire has no texture that lasts, so any one method errs on much of it, each in its own way; of
    Farneback's expansion, TV-L1, DeepFlow and Lucas-Kanade filled in along edges, two or more are
    right in most places. OpenCV's robust local flow is not among them: what it finds depends on
    what ran before it.
    """
    before, after = _pair(clip, i)
    first, second = (cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) for picture in (before, after))
    blank = np.zeros((4, *before.shape, 2), np.float32)
    found = (
        cv2.calcOpticalFlowFarneback(before, after, blank[0], 0.5, 5, 21, 5, 7, 1.5, 0),
        cv2.optflow.createOptFlow_DualTVL1().calc(before, after, blank[1]),
        cv2.optflow.createOptFlow_DeepFlow().calc(before, after, blank[2]),
        cv2.optflow.calcOpticalFlowSparseToDense(first, second, blank[3], 2),
    )
    return np.asarray(np.median(np.stack(found), axis=0), np.float32)


def flows_of(clip: Clip, method: Callable[[Clip, int], Flow]) -> list[Flow]:
    """Flow of every frame that has a following one."""
    return [method(clip, i) for i in range(clip.count - 1)]


@dataclass(frozen=True, slots=True)
class Places:
    """Velocities, px a frame, at the same places: (places, 2) each.

    Attributes:
        flakes: Of the flakes.
        flow, other: Of the flame there, by one method and another.
    """

    flakes: Array
    flow: Array
    other: Array


def in_the_flame(effect: EffectRun, flows: list[Flow], others: list[Flow]) -> Places:
    """Collect every row of the tracks of an ember in moving flame; sparks do not follow the gas."""
    clip = effect.clip
    gathered: list[tuple[Array, Array, Array]] = []
    for i, (flow, other) in enumerate(zip(flows, others, strict=True)):
        rows = effect.tracks.frames[i]
        at = pixel_of(rows, clip)
        here = flow[at].astype(np.float64)
        seen = (rows[:, X] >= 0) & (rows[:, X] < clip.width)
        seen &= (rows[:, Y] >= 0) & (rows[:, Y] < clip.height)
        seen &= (clip.brightness(i)[at] > FLAME) & (np.hypot(*here.T) > MOVES)
        seen &= rows[:, KIND] == EMBER
        velocity = rows[:, [VX, VY]] / clip.fps
        gathered.append((velocity[seen], here[seen], other[at].astype(np.float64)[seen]))
    return Places(*(np.concatenate(parts) for parts in zip(*gathered, strict=True)))


def correlation(one: Array, other: Array) -> tuple[float, float]:
    """Correlation of two sets of velocities, (places, 2) each, in x and in y."""
    if len(one) < 3:
        return float("nan"), float("nan")
    x, y = (float(np.corrcoef(one[:, c], other[:, c])[0, 1]) for c in (0, 1))
    return x, y


def share_that_rises(effect: EffectRun) -> float:
    """Share of the embers seen at least twice that end higher than they began."""
    tracks = effect.tracks
    rows, flight = np.concatenate(tracks.frames), np.concatenate(tracks.flights)
    order = np.lexsort((np.concatenate(tracks.flight_frames), flight))
    flights = np.split(rows[order], np.flatnonzero(np.diff(flight[order])) + 1)
    embers = [f for f in flights if f[0, KIND] == EMBER and len(f) > 1]
    return float(np.mean([f[-1, Y] < f[0, Y] for f in embers]))


def plume_speed(effect: EffectRun) -> float:
    """Mean speed, heights/s, of the field where the clip is dark."""
    field, clip = effect.analysis.field, effect.clip
    speeds: list[Plane] = []
    for i in range(clip.count):
        dark = cell_means(clip.brightness(i), field.cell) < DARK
        assert dark.shape == grid_shape(clip.width, clip.height, field.cell)
        speeds.append(np.hypot(field.u[i], field.v[i])[dark])
    return float(np.concatenate(speeds).mean()) / clip.height


def crowding(effect: EffectRun) -> tuple[float, float]:
    """Most rows in any 5 % of the plume, and in one of 20 x 20 cells, against the plume's mean.

    The plume is where 95 % of the rows are: cells that a stray flake crosses once are none of it
    (counting them would make a plume that spreads look worse than one that does not).
    """
    fine, coarse = _counted(effect, 2 * CELLS), _counted(effect, CELLS)
    if not coarse.any():
        return 0.0, 0.0
    plume = _plume(fine)
    side = max(1, round(math.sqrt(0.05 * len(plume))))
    squares = sliding_window_view(fine, (side, side)).mean(axis=(2, 3))
    return float(squares.max() / plume.mean()), float(coarse.max() / _plume(coarse).mean())


def _counted(effect: EffectRun, cells: int) -> Array:
    """Rows of the tracks in each of ``cells`` x ``cells`` parts of the frame, where it is dark."""
    clip, count = effect.clip, np.zeros((cells, cells))
    for i, rows in enumerate(effect.tracks.frames):
        at = pixel_of(rows, clip)
        inside = (rows[:, X] >= 0) & (rows[:, X] < clip.width)
        inside &= (rows[:, Y] >= 0) & (rows[:, Y] < clip.height)
        dark = rows[inside & (clip.brightness(i)[at] < DARK)]
        row = (dark[:, Y] / clip.height * cells).astype(np.intp)
        column = (dark[:, X] / clip.width * cells).astype(np.intp)
        np.add.at(count, (row, column), 1)
    return count


def _plume(count: Array) -> Array:
    """Counts of the cells that make up the plume, the fullest first."""
    dense = np.sort(count.ravel())[::-1]
    return dense[: int(np.searchsorted(np.cumsum(dense), 0.95 * dense.sum())) + 1]


def _pair(clip: Clip, i: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    before, after = (
        np.clip(np.rint(clip.brightness(k)), 0, 255).astype(np.uint8) for k in (i, i + 1)
    )
    return before, after
