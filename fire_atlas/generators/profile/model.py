"""A fire profile: everything learnt of a fire from a clip (Lee et al., III-A and III-B).

Most lengths are in flame heights: 1 is the median height of the flame in the clip.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Bytes, Pixels, decode_bytes

MIN_FRAMES, MAX_FRAMES = 4, 160
"""Frames a clip to learn from may have; 8 to 60 are best."""

NODES = 16
"""Heights at which pose curves are known; between them cubic splines run."""

HIGHEST_NODE = 1.6
"""Height of the last node, flame heights."""

SHADE_LEVELS = 12
"""Shades kept of a cell."""

SCORE_UNIT = 40.0
"""Steps of a byte per unit of a normal score; byte 128 is score 0."""

FLOW_UNIT = 8.0
"""Cells per second in a step of the profile file's flow, whose range is 127 steps either way."""

FLOW_CELL = 6
"""Cells in a row, and in a column, that share one flow vector."""

STATE_WIDTH = 10.0
"""Range of leans that one leaning state covers, degrees."""

STATE_EDGES = (-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0)
"""Leans between which the six states lie, degrees; the outermost ones have no outer limit."""

Period = Literal["swing", "rest"]
"""Whether the lean changes fast in a frame, or hardly."""

Origin = Literal["own", "mirrored", "sheared"]
"""Which frames a leaning set has: those of its lean; those of the opposite lean, to be mirrored;
or those nearest to it, to be sheared."""


class FeaturePoints(NamedTuple):
    """The six feature points of a flame's outline, each (x, y) in px of its frame (Figure 5).

    ``left`` and ``right`` are the ends of the widest row of the persistent regime, ``top`` and
    ``bottom`` the middles of the highest row and of the foot, ``mid_left`` and ``mid_right`` where
    the lower outline passes half way between them and ``bottom``.
    """

    left: tuple[float, float]
    mid_left: tuple[float, float]
    bottom: tuple[float, float]
    mid_right: tuple[float, float]
    right: tuple[float, float]
    top: tuple[float, float]

    @property
    def lean(self) -> float:
        """Angle of the line from ``bottom`` to ``top``, degrees, from upright to the right."""
        return math.degrees(math.atan2(self.top[0] - self.bottom[0], self.bottom[1] - self.top[1]))

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
        coverage: (n, n) float32, 0..1: how much of the cell is flame, on average.
    """

    colours: Bytes
    coverage: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class LeaningSet:
    """The frames that show one leaning state in one period (Figure 7).

    Attributes:
        low, high: Lean of the state, degrees.
        period: ``swing`` or ``rest``.
        origin: Which frames they are.
        frames: Their numbers, in order.
    """

    low: float
    high: float
    period: Period
    origin: Origin
    frames: tuple[int, ...]


def leaning_state(lean: float) -> int:
    """Return the index of the leaning state, 0..5, of a lean in degrees."""
    state = np.floor(lean / STATE_WIDTH) + len(STATE_EDGES) // 2
    return int(np.clip(state, 0, len(STATE_EDGES) - 2))


@dataclass(frozen=True, slots=True)
class DetailGrid:
    """The cells in which the detail of a flame is kept, the flame straightened.

    Attributes:
        rows_above, rows_below: Rows above and below the base.
        half_columns: Columns to either side of the axis.
        cells_per_height: Cells in a flame's height.
        cells_per_half: Cells in half the width of its foot.
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
        """(columns,) of each column's middle from the axis, half widths of the foot."""
        middles = np.arange(2 * self.half_columns) + 0.5
        return np.asarray((middles - self.half_columns) / self.cells_per_half)


@dataclass(frozen=True, slots=True)
class PoseCurves:
    """How the flame sways: where its middle is and how wide it is, by height, in every frame.

    Attributes:
        offset: (frames, NODES) of the middle from the axis, flame heights, to the right.
        width_ratio: (frames, NODES) width divided by its mean over the clip.
    """

    offset: NDArray[np.float64]
    width_ratio: NDArray[np.float64]


def node_heights() -> NDArray[np.float64]:
    """(NODES,) heights of the nodes above the base, flame heights."""
    return np.linspace(0.0, HIGHEST_NODE, NODES)


def interpolated(curve: NDArray[np.float64], heights: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the values of a pose curve (NODES,) at ``heights``; beyond its ends it is constant."""
    weights = _node_weights()(np.clip(heights, 0.0, HIGHEST_NODE))
    return np.asarray(weights @ curve, np.float64)


@cache
def _node_weights() -> CubicSpline:
    """Weight of each node at a height, (NODES,), in a cubic spline that is level at its ends."""
    return CubicSpline(node_heights(), np.eye(NODES), bc_type="clamped")


@dataclass(frozen=True, slots=True)
class DetailModel:
    """The detail of a flame: the colours each cell takes, and when it takes which.

    Attributes:
        scores: (frames, rows, columns) uint8: ``(value - 128) / SCORE_UNIT`` is the normal score of
            a cell's brightness among all frames.
        shades: (levels, rows, columns, 4) uint8 sRGB, straight, from dimmest to brightest.
        flow: (frames, r, c, 2) float32: velocity of the detail on the grid, x and y (down), cells
            per second, for squares of ``FLOW_CELL`` cells.
        autocorrelation: Correlation of the scores of one frame with those of the next, 0..1.
        correlation_length: Columns apart at which scores correlate by less than a half.
        is_symmetric: Whether left and right look alike, so that frames may be mirrored.
    """

    scores: Bytes
    shades: Bytes
    flow: NDArray[np.float32]
    autocorrelation: float
    correlation_length: float
    is_symmetric: bool

    @property
    def count(self) -> int:
        """Number of frames."""
        return len(self.scores)


def decoded_shades(shades: Bytes) -> Pixels:
    """Return the pixels of shades (..., columns, 4), which are straight sRGB and coverage."""
    flat = shades.reshape(-1, shades.shape[-2], 4)
    alpha = flat[..., 3:].astype(np.float32) / np.float32(255)
    colour = decode_bytes(np.ascontiguousarray(flat[..., :3])) * alpha
    return np.concatenate([colour, alpha], axis=-1).reshape(shades.shape)


class Percentiles(NamedTuple):
    """Median, 5th and 95th percentile of a figure over all frames."""

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
        lean: Degrees, to the right.
        brightness: Mean of the flame's pixels, linear, 0..1.
        step: 99th percentile of the difference of neighbouring frames (``frame_difference``).
    """

    height: Percentiles
    width: Percentiles
    lean: Percentiles
    brightness: Percentiles
    step: float


@dataclass(frozen=True, slots=True)
class Side:
    """One side of a fire, as learnt from one clip.

    Attributes:
        fps: Frames per second of the clip.
        closed: Whether its first frame follows its last.
        threshold: Brightness above which a pixel is flame, 0..255.
        points: Feature points of every frame.
        statistics: Statistics of its frames.
        sets: The twelve leaning sets: six states, each in two periods.
        half_width: Half the width of the foot, flame heights.
        pose: How the flame sways.
        detail: What the flame looks like, its sway taken out.
    """

    fps: float
    closed: bool
    threshold: float
    points: tuple[FeaturePoints, ...]
    statistics: ClipStatistics
    sets: tuple[LeaningSet, ...]
    half_width: float
    pose: PoseCurves
    detail: DetailModel

    @property
    def leans(self) -> list[float]:
        """Lean of every frame, degrees."""
        return [points.lean for points in self.points]


@dataclass(frozen=True, slots=True)
class Profile:
    """A fire as it was learnt: all that is needed to generate more of it.

    Attributes:
        grid: The cells in which its detail is kept.
        rise_speed: Of the flame in its intermittent zone, flame heights per second.
        playback_speed: At which the clip is played, 1 its own: the result then changes no faster
            from frame to frame than the clip.
        colours: Colours to generate; a user may have edited them.
        learnt_colours: Colours of the clip.
        front: Learnt from the first clip.
        side: Learnt from a clip taken at a right angle to it, if there was one.
    """

    grid: DetailGrid
    rise_speed: float
    playback_speed: float
    colours: ColourTable
    learnt_colours: ColourTable
    front: Side
    side: Side | None

    @property
    def sides(self) -> tuple[Side, ...]:
        """The front, and the side if there is one."""
        return (self.front,) if self.side is None else (self.front, self.side)
