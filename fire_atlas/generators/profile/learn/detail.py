"""Learn the sway of a flame (pose curves) and, separately, its look (detail on a straight grid).

A flame sways between its base and its top like a cloth. The sway is learnt as two curves over
height and removed from the frames before their detail is learnt.

Each cell of the grid is bright in some frames and dark in others. Two things are stored: the
colours of each cell from dimmest to brightest (``shades``), and the rank of each cell's brightness
in each frame among all frames, as a normal score (``scores``). Scores of different frames can be
blended: if they are independent and N(0, 1), then Σ w·s / √Σ w² is N(0, 1) as well. Looked up among
the shades, it gives each cell the clip's colours, as often and as sharp as there; blended colours
would be blurred and dull. (Histogram-preserving blending of textures, Heitz and Neyret 2018.)
"""

import itertools
import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, gaussian_filter1d
from scipy.special import ndtri

from fire_atlas.core.clip import Clip
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.picture import as_bytes
from fire_atlas.core.pixels import (
    Bytes,
    Pixels,
    Plane,
    as_plane,
    brightness,
)
from fire_atlas.core.workers import Workers
from fire_atlas.generators.profile.learn.measure import ClipMeasurements
from fire_atlas.generators.profile.model import (
    FLOW_CELL,
    FLOW_UNIT,
    MAX_FRAMES,
    SCORE_UNIT,
    SHADE_LEVELS,
    DetailGrid,
    DetailModel,
    PoseCurves,
    decoded_shades,
    interpolated,
    node_heights,
)
from fire_atlas.vision.flow import SMALLEST_SIDE, optical_flow
from fire_atlas.vision.warp import sample_at

_MIN_CELLS, _MAX_CELLS = 80, 224
"""Minimum and maximum number of cells per flame height."""

_HEIGHT_SIGMA, _TIME_SIGMA, _GAP_SIGMA = 0.06, 0.6, 0.3
"""Standard deviations of the smoothing of pose curves: over height (flame heights), over time
(frames), and over height where rows are dark (flame heights)."""

_RESTING, _RESTING_SIGMA = 2.0, 2.5
"""Standard deviation of the movement of an edge at which it and its surroundings rank frames alike,
and that of the surroundings, cells."""

_MAX_RESTING = 100.0
"""Maximum weight of an edge's surroundings, relative to its own."""

_TIP = 0.06
"""Fraction of the flame's height over which a tip that is cut off fades out below the edge."""

_UPRIGHT = 1.5
"""Maximum lean of a fire that counts as symmetric, degrees."""

_FRAME_BITS = MAX_FRAMES.bit_length()
"""Bits of the number of a frame."""

_NOISE_SIGMA = 0.5
"""Standard deviation of the blur that removes noise from scores, cells."""


def detail_grid(sides: Sequence[ClipMeasurements]) -> DetailGrid:
    """Return a grid that holds the fire of all clips, at about the scale of the first."""
    first = sides[0]
    # Small frames are enlarged by a whole factor, which keeps the pixels of a sprite sharp.
    factor = max(1, math.ceil(_MIN_CELLS / first.height))
    per_height = min(first.height * factor, _MAX_CELLS)
    per_half = per_height * first.half_width / first.height
    above = below = aside = 0.0
    for side in sides:
        (x, foot), (left, right, top, bottom) = side.base, side.bounds
        above = max(above, (foot - top) / side.height)
        below = max(below, (bottom - foot) / side.height)
        aside = max(aside, max(x - left, right - x) / side.half_width)
    return DetailGrid(
        rows_above=round(per_height * min(above, 2.0)) + 2,
        rows_below=round(per_height * min(below, 0.5)) + 2,
        half_columns=round(per_half * min(aside, 8.0)) + 3,
        cells_per_height=per_height,
        cells_per_half=per_half,
    )


def learn_pose(measured: ClipMeasurements) -> PoseCurves:
    """Return the pose curves of every frame."""
    (x, foot), height = measured.base, measured.height
    rows = foot - (np.arange(measured.row_weight.shape[1]) + 0.5)
    mode = "wrap" if measured.closed else "nearest"
    weight = measured.row_weight * (rows > 0)
    offset = _smoothed(weight, (measured.row_centre - x) / height, height, mode)
    spread = _smoothed(weight, measured.row_spread / height, height, mode)
    ratio = np.clip(spread / np.maximum(spread.mean(axis=0), 1e-3), 0.7, 1.4)
    # Reversed, because row 0 is the top and interpolation needs ascending heights.
    heights = rows[::-1] / height
    nodes = node_heights()
    above_foot = smooth_step(nodes / 0.2)

    def at_nodes(values: NDArray[np.float64], at_base: float) -> NDArray[np.float64]:
        found = np.stack([np.interp(nodes, heights, row[::-1]) for row in values])
        return at_base + (found - at_base) * above_foot

    return PoseCurves(at_nodes(offset, 0.0).round(5), at_nodes(ratio, 1.0).round(5))


def _smoothed(
    weight: NDArray[np.float64], values: NDArray[np.float64], height: float, mode: str
) -> NDArray[np.float64]:
    """Smooth ``values`` (frames, H) by the weight of each row; dark rows use those near them."""
    sigma = (_TIME_SIGMA, _HEIGHT_SIGMA * height)

    def blurred(plane: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(gaussian_filter(plane, sigma, mode=(mode, "nearest")))

    total, weighted = blurred(weight), blurred(weight * values)
    gap_sigma = _GAP_SIGMA * height
    wide_total = gaussian_filter1d(total, gap_sigma, axis=1) + 1e-9
    wide = gaussian_filter1d(weighted, gap_sigma, axis=1) / wide_total
    prior = 0.05 * total.max()
    return np.asarray((weighted + prior * wide) / (total + prior), np.float64)


def learn_detail(
    clip: Clip, measured: ClipMeasurements, pose: PoseCurves, grid: DetailGrid, workers: Workers
) -> DetailModel:
    """Straighten every frame of ``clip`` onto ``grid`` and learn its scores, shades and flow."""

    def straight(i: int) -> tuple[Bytes, Plane]:
        fire = measured.mask.isolated(clip.read(i))
        flat = _straightened(fire, i, measured, pose, grid)
        return as_bytes(flat), brightness(flat, clip.blend_space)

    pictures, planes = zip(*workers.map(straight, range(clip.count)), strict=True)
    bright = np.stack(planes)
    scores = _normal_scores(bright)
    varies = np.ptp(bright, axis=0) > 16
    return DetailModel(
        scores=np.clip(np.rint(scores * SCORE_UNIT + 128), 0, 255).astype(np.uint8),
        shades=_shades(np.stack(pictures), _ascending(bright)),
        flow=_flow(planes, clip.fps),
        autocorrelation=_autocorrelation(scores, varies),
        correlation_length=_correlation_length(scores, varies),
    )


def _straightened(
    fire: Pixels, i: int, measured: ClipMeasurements, pose: PoseCurves, grid: DetailGrid
) -> Pixels:
    """Return frame ``i`` on the grid, its sway removed."""
    (x, foot), height, half = measured.base, measured.height, measured.half_width
    heights = grid.heights
    middle = x + interpolated(pose.offset[i], heights) * height
    half_width = interpolated(pose.width_ratio[i], heights) * half
    columns = middle[:, None] + half_width[:, None] * grid.offsets - 0.5
    rows = np.broadcast_to((foot - heights * height - 0.5)[:, None], grid.shape)
    flat = sample_at(fire, columns, rows, cv2.INTER_CUBIC, cv2.BORDER_CONSTANT)
    flat = np.clip(flat, 0, None)
    flat[..., 3] = np.minimum(flat[..., 3], 1)
    if measured.cut_share > 0:
        fade = smooth_step((rows + 0.5) / (_TIP * height))
        flat *= fade[..., None].astype(np.float32)
    return as_plane(flat)


def _normal_scores(bright: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return normal scores (frames, rows, columns) of each cell's brightness among all frames."""
    order = _ascending(_with_surroundings(bright))
    quantiles = ndtri((np.arange(len(bright)) + 0.5) / len(bright))
    quantiles = (quantiles / quantiles.std()).astype(np.float32)
    of_cells = np.empty(order.shape, np.float32)
    np.put_along_axis(of_cells, order, np.broadcast_to(quantiles, order.shape), axis=-1)
    scores = np.ascontiguousarray(np.moveaxis(of_cells, -1, 0))
    for plane in scores:
        cv2.GaussianBlur(plane, (0, 0), _NOISE_SIGMA, plane)
    scores /= scores.std(axis=0)
    return scores


def _ascending(values: NDArray[np.float32]) -> NDArray[np.intp]:
    """Return the numbers of the frames (rows, columns, frames) by the value of each cell in them,
    ascending, and of equal values in their order; ``values`` (frames, rows, columns) are not
    negative."""
    # Bits of such floats ascend as they do. Whole numbers are sorted several times as fast.
    of_cells = np.ascontiguousarray(np.moveaxis(np.abs(values), 0, -1)).view(np.uint32)
    keys = of_cells.astype(np.uint64)
    keys <<= _FRAME_BITS
    keys |= np.arange(len(values), dtype=np.uint64)
    keys.sort(axis=-1)
    keys &= (1 << _FRAME_BITS) - 1
    return keys.view(np.intp)


def _with_surroundings(bright: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the values (frames, rows, columns) by which the frames of each cell are ranked.

    That is the brightness, plus some of its surroundings': frames whose brightness differs only by
    noise then have a similar order in neighbouring cells, so blended scores have smooth outlines.
    """
    key, resting = bright.copy(), _resting(bright)
    for plane, total in zip(bright, key, strict=True):
        for sigma, weight in ((2.0, 0.3), (6.0, 0.2), (_RESTING_SIGMA, resting)):
            total += np.float32(weight) * cv2.GaussianBlur(plane, (0, 0), sigma)
    return key


def _resting(bright: NDArray[np.float32]) -> Plane:
    """Return the weight (rows, columns) of the surroundings of an edge that rests.

    Straightened frames have a steady outline in the same cells but for fractions of one, which
    resampling changes from cell to cell: ranked by that alone, frames have another order in every
    cell, and the outline of their blend is nicked. How far an edge moves, in cells, is the change
    of brightness in time by that in space.
    """
    down, right = np.gradient(bright.mean(axis=0))
    change, slope = (
        cv2.GaussianBlur(as_plane(power), (0, 0), _RESTING_SIGMA)
        for power in (bright.var(axis=0), down * down + right * right)
    )
    moves = change / np.maximum(slope, 1e-3)
    weight = np.square(_RESTING**2 / np.maximum(moves, 1e-3))
    return as_plane(np.minimum(weight, _MAX_RESTING))


def _shades(pictures: Bytes, order: NDArray[np.intp]) -> Bytes:
    """Return ``DetailModel.shades``: each cell's colours at evenly spaced ranks of brightness.

    Args:
        pictures: (frames, rows, columns, 4) straight sRGB and coverage.
        order: (rows, columns, frames) frames by the brightness of each cell in them.
    """
    count = len(pictures)
    levels = min(SHADE_LEVELS, count)
    places = np.linspace(0, count - 1, levels)
    lower = places.astype(np.intp)
    # The four channels of a cell as one value, and those of its frames side by side.
    of_cells = np.ascontiguousarray(np.moveaxis(pictures.view(np.uint32)[..., 0], 0, -1))
    dim, bright = (
        np.take_along_axis(of_cells, order[..., ranks], axis=-1)
        for ranks in (lower, np.minimum(lower + 1, count - 1))
    )
    shades = np.empty((levels, *pictures.shape[1:]), np.uint8)
    for level, share in enumerate((places - lower).astype(np.float32)):
        pair = [
            decoded_shades(np.ascontiguousarray(seen[..., level : level + 1]).view(np.uint8))
            for seen in (dim, bright)
        ]
        shades[level] = as_bytes(pair[0] * (1 - share) + pair[1] * share)
    return shades


def _flow(bright: Sequence[Plane], fps: float) -> NDArray[np.float32]:
    """Return ``DetailModel.flow``: optical flow from each straightened frame to the next."""
    rows, columns = bright[0].shape
    size = -(-columns // FLOW_CELL), -(-rows // FLOW_CELL)
    missing = max(0, SMALLEST_SIDE - columns)
    pictures = [
        np.pad(np.clip(np.rint(plane), 0, 255).astype(np.uint8), ((0, 0), (0, missing)))
        for plane in bright
    ]
    flows = [
        optical_flow(before, after, is_small=True)[:, :columns]
        for before, after in itertools.pairwise(pictures)
    ]
    flows.append(flows[-1])
    coarse = [cv2.resize(flow, size, interpolation=cv2.INTER_AREA) * fps for flow in flows]
    steps = np.clip(np.rint(np.stack(coarse) / FLOW_UNIT), -127, 127)
    return (steps * FLOW_UNIT).astype(np.float32)


def _autocorrelation(scores: NDArray[np.float32], varies: NDArray[np.bool_]) -> float:
    if not varies.any():
        return 1.0
    products = [(a * b)[varies].mean() for a, b in itertools.pairwise(scores)]
    return float(np.clip(np.mean(products), 0.0, 1.0))


def _correlation_length(scores: NDArray[np.float32], varies: NDArray[np.bool_]) -> float:
    """Return the distance in columns at which scores correlate by less than 0.5 on average."""
    for apart in range(1, scores.shape[2] // 2):
        both = varies[:, apart:] & varies[:, :-apart]
        if not both.any():
            return float(apart)
        products = np.zeros(both.shape, np.float32)
        for plane in scores:  # all at once they would not fit into the processor's cache
            products += plane[:, apart:] * plane[:, :-apart]
        if float((products / len(scores))[both].mean()) < 0.5:
            return float(apart)
    return float(scores.shape[2] / 2)
