"""The fire profile: everything learnt from a clip of fire (Lee et al., III-A and III-B).

Most lengths are in flame heights: 1 is the median height of the flame in the clip.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d

from fire_atlas.core.pixels import Bytes, Pixels, decode_bytes

MIN_FRAMES, MAX_FRAMES = 4, 160
"""Limits on the frames of a clip to learn from."""

FEW_FRAMES, MANY_FRAMES = 8, 60
"""Fewer frames than these show too few poses of the fire; more mostly make the profile larger."""

NODES = 16
"""Number of heights at which pose curves are stored; cubic splines run between them."""

HIGHEST_NODE = 1.6
"""Height of the highest node, flame heights."""

SHADE_LEVELS = 12
"""Maximum number of shades stored per cell."""

SCORE_UNIT = 40.0
"""Byte steps per unit of normal score; byte 128 is score 0."""

FLOW_UNIT = 8.0
"""Cells per second per step of the flow in the profile file: -127 to 127 steps."""

FLOW_CELL = 6
"""Side of the square of grid cells that share one flow vector."""

STATE_WIDTH = 10.0
"""Range of lean that one leaning state covers, degrees."""

STATE_EDGES = (-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0)
"""Limits of the six leaning states, degrees; the outermost states have no outer limit."""

_PERIOD_SIGMA = 2.0
"""Standard deviation of the smoothing that tells periods apart, frames: each lasts some frames."""

_NODE_DISTANCE = HIGHEST_NODE / (NODES - 1)
"""Distance of neighbouring nodes, flame heights."""

Period = Literal["swing", "rest"]
"""Whether the lean changes fast in a frame (``swing``) or hardly (``rest``)."""

Origin = Literal["own", "mirrored", "sheared"]
"""Where a leaning set's frames come from: frames of its own lean, frames of the opposite lean to be
mirrored, or the frames of the most similar lean, to be sheared."""


class FeaturePoints(NamedTuple):
    """The six feature points of a flame's outline, each (x, y) in px of its frame (Figure 5).

    ``left`` and ``right`` are the ends of the widest row in the lowest fifth of the flame; ``top``
    is the middle of the highest row, ``bottom`` that of the foot. ``mid_left`` and ``mid_right``
    are on the lower outline, halfway across from ``left`` and ``right`` to ``bottom``.
    """

    left: tuple[float, float]
    mid_left: tuple[float, float]
    bottom: tuple[float, float]
    mid_right: tuple[float, float]
    right: tuple[float, float]
    top: tuple[float, float]

    @property
    def height(self) -> float:
        """Vertical distance from ``bottom`` to ``top``, px."""
        return self.bottom[1] - self.top[1]

    @property
    def width(self) -> float:
        """Horizontal distance from ``left`` to ``right``, px."""
        return self.right[0] - self.left[0]


@dataclass(frozen=True, slots=True)
class ColourTable:
    """The spatial fire colour correlation table: mean colour by place in the flame (III-B).

    Attributes:
        colours: (n, n, 3) uint8 sRGB, straight: rows from the top of the flame's box down.
        coverage: (n, n) float32, 0..1: mean fraction of the cell that is flame.
    """

    colours: Bytes
    coverage: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class LeaningSet:
    """The frames that show one leaning state in one period (Figure 7).

    Attributes:
        low, high: Limits of the state's lean, degrees.
        period: ``swing`` or ``rest``.
        origin: Where the frames come from.
        shear: Degrees by which they are sheared to the right; 0 unless ``origin`` is ``sheared``.
        frames: Numbers of the frames, ascending.
    """

    low: float
    high: float
    period: Period
    origin: Origin
    shear: float
    frames: tuple[int, ...]


def leaning_state(lean: float) -> int:
    """Return the index (0..5) of the leaning state for a lean in degrees."""
    state = np.floor(lean / STATE_WIDTH) + len(STATE_EDGES) // 2
    return int(np.clip(state, 0, len(STATE_EDGES) - 2))


def swinging(leans: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which frames (frames,) belong to the period ``swing``: the half in which the lean
    (frames,), degrees, changes faster."""
    speed = np.abs(np.gradient(leans)) if len(leans) > 1 else np.zeros(1)
    smoothed = gaussian_filter1d(speed, _PERIOD_SIGMA)
    swings = np.zeros(len(leans), np.bool_)
    swings[np.argsort(-smoothed, kind="stable")[: len(leans) // 2]] = True
    return swings


@dataclass(frozen=True, slots=True)
class DetailGrid:
    """The grid on which the detail of a straightened flame is stored.

    Attributes:
        rows_above, rows_below: Rows above and below the base.
        half_columns: Columns to either side of the axis.
        cells_per_height: Cells per flame height.
        cells_per_half: Cells per half width of the flame's foot.
    """

    rows_above: int
    rows_below: int
    half_columns: int
    cells_per_height: float
    cells_per_half: float

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.rows_above + self.rows_below, 2 * self.half_columns

    @property
    def heights(self) -> NDArray[np.float64]:
        """(rows,) height of each row's middle above the base, flame heights."""
        return np.asarray(
            (self.rows_above - np.arange(self.shape[0]) - 0.5) / self.cells_per_height
        )

    @property
    def offsets(self) -> NDArray[np.float64]:
        """(columns,) distance of each column's middle from the axis, half widths of the foot."""
        middles = np.arange(2 * self.half_columns) + 0.5
        return np.asarray((middles - self.half_columns) / self.cells_per_half)


@dataclass(frozen=True, slots=True)
class PoseCurves:
    """Sway of the flame: position of its middle and its width, by height, in every frame.

    Attributes:
        offset: (frames, NODES) distance of the middle to the right of the axis, flame heights.
        width_ratio: (frames, NODES) width divided by its mean over the clip.
    """

    offset: NDArray[np.float64]
    width_ratio: NDArray[np.float64]


def node_heights() -> NDArray[np.float64]:
    """(NODES,) heights of the nodes above the base, flame heights."""
    return np.linspace(0.0, HIGHEST_NODE, NODES)


def interpolated(curve: NDArray[np.float64], heights: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the values of a pose curve (NODES,) at ``heights``: a cubic spline through its nodes,
    level at its ends and constant beyond them."""
    place = np.clip(heights, 0.0, HIGHEST_NODE) / _NODE_DISTANCE
    node = np.minimum(place.astype(np.intp), NODES - 2)
    slopes = _node_slopes() @ curve
    (y0, y1), (s0, s1) = ((values[node], values[node + 1]) for values in (curve, slopes))
    t = place - node
    # Hermite's cubic between two nodes.
    rise = y1 - y0
    return np.asarray(
        y0 + t * (s0 + t * (3 * rise - 2 * s0 - s1 + t * (s0 + s1 - 2 * rise))), np.float64
    )


@cache
def _node_slopes() -> NDArray[np.float64]:
    """(NODES, NODES): slope of the spline at each node, per distance of nodes, for a value of 1 at
    each node: that with which its curvature is continuous, and 0 at the ends."""
    inside = np.arange(1, NODES - 1)
    equations, differences = np.eye(NODES), np.zeros((NODES, NODES))
    equations[inside, inside] = 4
    equations[inside, inside - 1] = equations[inside, inside + 1] = 1
    differences[inside, inside + 1], differences[inside, inside - 1] = 3, -3
    return np.asarray(np.linalg.solve(equations, differences), np.float64)


@dataclass(frozen=True, slots=True)
class DetailModel:
    """Look of the straightened flame: colours of each cell, and its brightness in each frame.

    Attributes:
        scores: (frames, rows, columns) uint8: rank of a cell's brightness among all frames, as a
            normal score ``(value - 128) / SCORE_UNIT``.
        shades: (levels, rows, columns, 4) uint8 straight sRGB and coverage, dimmest first.
        flow: (frames, r, c, 2) float32: velocity of the detail, cells per second, x right, y down,
            for each square of ``FLOW_CELL`` by ``FLOW_CELL`` cells.
        autocorrelation: Correlation of the scores of one frame with those of the next, 0..1.
        correlation_length: Distance in columns at which scores correlate by less than 0.5.
    """

    scores: Bytes
    shades: Bytes
    flow: NDArray[np.float32]
    autocorrelation: float
    correlation_length: float

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.scores)


def decoded_shades(shades: Bytes) -> Pixels:
    """Convert shades (..., columns, 4), straight sRGB and coverage, to pixels."""
    flat = shades.reshape(-1, shades.shape[-2], 4)
    alpha = flat[..., 3:].astype(np.float32) / np.float32(255)
    colour = decode_bytes(np.ascontiguousarray(flat[..., :3])) * alpha
    return np.concatenate([colour, alpha], axis=-1).reshape(shades.shape)


class Percentiles(NamedTuple):
    """Median, 5th and 95th percentile of a measurement over all frames."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: ArrayLike) -> "Percentiles":
        """Compute them from a list of numbers."""
        low, median, high = np.percentile(np.asarray(values, np.float64), [5, 50, 95])
        return cls(float(median), float(low), float(high))


@dataclass(frozen=True, slots=True)
class ClipStatistics:
    """Statistics of a clip's frames.

    Attributes:
        height, width: Size of the flame, px of the clip.
        lean: Lean of the flame to the right, degrees.
        brightness: Mean of the flame's pixels, linear, 0..1.
        step: 99th percentile of ``frame_difference`` between neighbouring frames.
    """

    height: Percentiles
    width: Percentiles
    lean: Percentiles
    brightness: Percentiles
    step: float


@dataclass(frozen=True, slots=True)
class Side:
    """One view of a fire, learnt from one clip.

    Attributes:
        fps: Frames per second of the clip.
        closed: Whether the clip loops.
        threshold: Brightness above which a pixel is flame, 0..255.
        points: Feature points of every frame; the user may have moved them.
        learnt_points: Feature points of every frame, as the clip shows them.
        leans: Lean of the flame in every frame, degrees to the right, from ``flame_lean``.
        statistics: Statistics of the frames.
        sets: The twelve leaning sets: six states, each in two periods.
        colours: Colours of generated fire seen from this side; the user may have edited them.
        learnt_colours: Colours of the clip.
        half_width: Half the width of the foot, flame heights.
        pose: Sway of the flame.
        detail: Look of the flame, its sway removed.
    """

    fps: float
    closed: bool
    threshold: float
    points: tuple[FeaturePoints, ...]
    learnt_points: tuple[FeaturePoints, ...]
    leans: tuple[float, ...]
    statistics: ClipStatistics
    sets: tuple[LeaningSet, ...]
    colours: ColourTable
    learnt_colours: ColourTable
    half_width: float
    pose: PoseCurves
    detail: DetailModel

    @property
    def base(self) -> tuple[float, float]:
        """(x, y) px at which the axis of the flame meets the ground."""
        middle = [(flame.left[0] + flame.right[0]) / 2 for flame in self.learnt_points]
        foot = [flame.bottom[1] for flame in self.learnt_points]
        return float(np.median(middle)), float(np.median(foot))


@dataclass(frozen=True, slots=True)
class Profile:
    """Everything learnt from a fire: all that is needed to generate more of it.

    Attributes:
        grid: Grid on which its detail is stored.
        rise_speed: Speed of the gas in the intermittent zone, flame heights per second.
        front: Learnt from the first clip.
        side: Learnt from a second clip, filmed at a right angle to the first; or None.
    """

    grid: DetailGrid
    rise_speed: float
    front: Side
    side: Side | None

    @property
    def sides(self) -> tuple[Side, ...]:
        """The front, and the side if there is one."""
        return (self.front,) if self.side is None else (self.front, self.side)
