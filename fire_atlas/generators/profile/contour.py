"""The outline of a flame and its six feature points (Lee et al., III-A, Figure 5)."""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

PERSISTENT = 0.2
"""Share of the flame's height that burns persistently: the lowest of McCaffrey's three regimes."""

_FOOT = 0.06
"""Share of the flame's height that its lowest ends differ by."""


class Points(NamedTuple):
    """Six points of a flame, px of its frame, each (x, y).

    ``left`` and ``right`` are the ends of the widest row of the persistent regime, ``top`` and
    ``bottom`` the middles of its highest row and of its foot, ``mid_left`` and ``mid_right`` where
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
        """Angle from Bottom to Top, degrees, from upright to the right."""
        return math.degrees(math.atan2(self.top[0] - self.bottom[0], self.bottom[1] - self.top[1]))

    @property
    def height(self) -> float:
        """From Bottom up to Top, px."""
        return self.bottom[1] - self.top[1]

    @property
    def width(self) -> float:
        """From Left to Right, px."""
        return self.right[0] - self.left[0]


def contour(flame: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(H, W): the flame's pixels that have an edge: where Sobel's gradient of the binarized frame
    is not zero. What the frame cuts off is an edge too."""
    framed = np.pad(flame.astype(np.uint8), 1)
    gx = cv2.Sobel(framed, cv2.CV_16S, 1, 0)
    gy = cv2.Sobel(framed, cv2.CV_16S, 0, 1)
    return np.asarray(((gx != 0) | (gy != 0))[1:-1, 1:-1] & flame, np.bool_)


def feature_points(flame: NDArray[np.bool_]) -> Points:
    """Six points of a flame, given as the mask (H, W) of its pixels, of which there must be some.

    A pixel's far sides count: a flame of columns 3 and 4 reaches from 3.0 to 5.0.
    """
    edge = contour(flame)
    rows = np.flatnonzero(edge.any(axis=1))
    top, bottom = int(rows[0]), int(rows[-1])
    lowest = math.floor(bottom + 1 - PERSISTENT * (bottom + 1 - top))
    left, right, row = _widest(edge, range(max(lowest, top), bottom + 1))
    # Of a foot with several ends now one is the lowest, now another: all of them count.
    ends = max(1, math.ceil(_FOOT * (bottom + 1 - top)))
    foot = _middle(edge[bottom + 1 - ends : bottom + 1]), bottom + 1.0
    return Points(
        left=(left, row),
        mid_left=_below(edge, (left + foot[0]) / 2),
        bottom=foot,
        mid_right=_below(edge, (foot[0] + right) / 2),
        right=(right, row),
        top=(_middle(edge[top : top + 1]), float(top)),
    )


def _widest(edge: NDArray[np.bool_], rows: range) -> tuple[float, float, float]:
    """Left and right end of the widest of ``rows``, and its middle; of equals the lowest."""
    ends = [(np.flatnonzero(edge[row]), row) for row in rows]
    columns, row = max(
        ((found, row) for found, row in reversed(ends) if found.size),
        key=lambda end: end[0][-1] - end[0][0],
    )
    return float(columns[0]), float(columns[-1] + 1), row + 0.5


def _middle(rows: NDArray[np.bool_]) -> float:
    columns = np.flatnonzero(rows.any(axis=0))
    return float(columns[0] + columns[-1] + 1) / 2


def _below(edge: NDArray[np.bool_], x: float) -> tuple[float, float]:
    """Return where the lower outline passes ``x``; the outline may have gaps there."""
    found = edge.any(axis=0)
    columns = np.flatnonzero(found)
    column = int(columns[np.argmin(np.abs(columns + 0.5 - x))])
    return x, float(np.flatnonzero(edge[:, column])[-1] + 1)
