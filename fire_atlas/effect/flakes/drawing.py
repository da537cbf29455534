"""Draw flakes: additive sprites at sub-pixel positions, in linear light that may exceed 1.

A soft flake is an ellipse, drawn in spans: a span is the pixels of one row inside it. Its ends are
computed in closed form, so that no pixel outside is touched. Ellipses of similar size are drawn
together, because numpy is only fast on long axes.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane
from fire_atlas.effect.flakes.tracks import COLUMNS

Column = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.intp]

_FLAKE_BATCH, _SPAN_BATCH = 1 << 18, 1 << 15
"""Area, px², of flakes, and of spans, that are drawn together: small enough for the processor's
cache, large enough to be worth a numpy call."""

_LARGE = 8.0
"""Half width, px, from which the samples at pixel centres sum to a sprite's light closely enough.
Such ellipses are clipped to the frame at once; small ones only after all pixels are summed."""

_HALO_SIGMA = 0.018
"""Width (σ) of a halo, heights."""

_MIN_WIDTH = 2.6
"""Minimum width of a soft sprite, px; a smaller one would flicker as it moves over the pixels."""


def drawn_width(width: NDArray[np.float64], hard: bool) -> NDArray[np.float64]:
    """Return the width, px, at which sprites are drawn; ``hard`` ones become one or two px wide."""
    return np.clip(np.rint(width), 1, 2) if hard else np.maximum(width, _MIN_WIDTH)


def draw_flakes(rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Draw the soft flakes of one frame on black: linear light (height, width, 3).

    Each row is a soft ellipse (1 − q²)² with q² = (2a/(size·stretch))² + (2b/size)², a along its
    rotation and b across; rgb·a is the light at its centre. The pixels of a small ellipse sum to
    its exact integral, wherever it lies between them.

    Args:
        rows: (flakes, 14), columns ``tracks.COLUMNS``.
        height, width: Frame, px.
    """
    canvas = np.zeros((height, width, 3), np.float32)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    across = column["size"] / 2
    along = across * column["stretch"]
    ellipses = _Ellipses.of(
        column["x"], column["y"], along, across, column["rotation"], (height, width)
    )
    light = np.stack([column[name] for name in "rgb"]) * column["a"]
    integral = along * across * (math.pi / 3)  # ∫(1 − q²)² over the ellipse
    for group in _batches(ellipses.rows, ellipses.area, _FLAKE_BATCH):
        spans = ellipses.spans(group)
        total = np.zeros(len(spans.length), np.float32)
        drawn = []
        for some in _batches(spans.length, spans.length, _SPAN_BATCH):
            weights = spans.weights(some)
            total[some] = weights.sum(axis=0)
            drawn.append((some, weights))
        total = total.reshape(-1, len(group)).sum(axis=0)
        # Large ellipses need no correction, and could not be corrected where the frame clips them.
        exact = np.where(across[group] < _LARGE, integral[group] / np.maximum(total, 1e-12), 1.0)
        shine = as_plane(light[:, group] * exact)
        for some, weights in drawn:
            _add(canvas, spans, some, weights, shine)
    return canvas


def draw_pixels(rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Draw the flakes of one frame as hard squares of ``size`` whole px: light (height, width, 3).

    Where squares overlap, each channel is the brighter of both: a sum would be a new colour.
    """
    light = np.zeros((height * width, 3), np.float32)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    side = column["size"].astype(np.intp)
    left = np.rint(column["x"] - side / 2)
    top = np.rint(column["y"] - side / 2)
    row_flake, row = _ranges(top, top + side - 1)
    span, x = _ranges(left[row_flake], (left + side - 1)[row_flake])
    flake, y = row_flake[span], row[span]
    seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    flake, pixel = flake[seen], (y[seen] * width + x[seen])
    for c, name in enumerate("rgb"):
        shine = (column[name] * column["a"]).astype(np.float32)
        np.maximum.at(light[:, c], pixel, shine[flake])
    return light.reshape(height, width, 3)


def add_halo(light: NDArray[np.float32], share: float, fades: bool) -> NDArray[np.float32]:
    """Add a soft halo, ``share`` times as bright as the layer, to a flake layer (H, W, 3).

    A halo that ``fades`` becomes 0 at the border of the frame.
    """
    height, width = light.shape[:2]
    sigma = _HALO_SIGMA * height
    halo = cv2.GaussianBlur(light, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
    if fades:
        down, across = (
            np.clip(np.minimum(np.arange(n), np.arange(n)[::-1]) / (2 * sigma), 0, 1)
            for n in (height, width)
        )
        halo = as_plane(halo * np.minimum.outer(down, across)[..., None])
    return as_plane(cv2.addWeighted(light, 1.0, halo, share, 0.0))


@dataclass(frozen=True, slots=True)
class _Ellipses:
    """Soft ellipses (1 − q²)², q² = p dx² + 2 r dx dy + s dy². Arrays (ellipses,).

    Along a row 1 − q² = depth − p (x − middle)². Coordinates count from the pixel at the ellipse's
    centre, so that single precision is exact enough.

    Attributes:
        column, row: Column of the centre, and first row covered, px.
        rows: Number of rows covered.
        area: Area of the bounding box, px².
        offset_x: From the centre of pixel ``column`` to the ellipse's centre, px.
        offset_y: From the ellipse's centre to the centre of the first row, px.
        curvature: p.
        slope: Shift of ``middle`` to the left from row to row, px: r / p.
        depth_loss: Decrease of ``depth`` with the squared distance from the centre: s − r² / p.
        first_column, last_column: Columns that may be covered, counted from ``column``.
    """

    column: Index
    row: Index
    rows: Index
    area: Index
    offset_x: Single
    offset_y: Single
    curvature: Single
    slope: Single
    depth_loss: Single
    first_column: Single
    last_column: Single

    @classmethod
    def of(
        cls,
        x: Column,
        y: Column,
        along: Column,
        across: Column,
        rotation: Column,
        frame: tuple[int, int],
    ) -> Self:
        """Return ellipses of half axes ``along`` their rotation (rad) and ``across`` it, px, in a
        ``frame`` (height, width)."""
        cos, sin = np.cos(rotation), np.sin(rotation)
        p = (cos / along) ** 2 + (sin / across) ** 2
        r = cos * sin * (along**-2 - across**-2)
        product = along * across  # p s − r² = 1 / product²
        height = np.sqrt(p) * product
        large = across >= _LARGE
        top = _clip_where(np.ceil(y - 0.5 - height), large, 0, frame[0])
        end = _clip_where(np.floor(y + 0.5 + height), large, 0, frame[0])
        column = np.floor(x)
        edge = np.where(large, 0, np.inf)
        return cls(
            column=column.astype(np.intp),
            row=top.astype(np.intp),
            rows=np.maximum(end - top, 0).astype(np.intp),
            area=(np.maximum(end - top, 0) * (2 * along + 1)).astype(np.intp),
            offset_x=as_plane(x - column - 0.5),
            offset_y=as_plane(top + 0.5 - y),
            curvature=as_plane(p),
            slope=as_plane(r / p),
            depth_loss=as_plane(1 / (p * product**2)),
            first_column=as_plane(-column - edge),
            last_column=as_plane(frame[1] - 1 - column + edge),
        )

    def spans(self, group: Index) -> "_RowSpans":
        """Return the spans of a group of ellipses, for each as many rows as the tallest has."""
        step = np.arange(self.rows[group].max())[:, None]
        dy = self.offset_y[group] + as_plane(step)
        depth = 1 - self.depth_loss[group] * dy * dy
        middle = self.offset_x[group] - self.slope[group] * dy
        half = np.sqrt(np.maximum(depth, 0) / self.curvature[group])
        first = np.maximum(np.ceil(middle - half), self.first_column[group])
        last = np.minimum(np.floor(middle + half), self.last_column[group])
        inside = (depth > 0) & (step < self.rows[group])
        return _RowSpans(
            x=(self.column[group] + first.astype(np.intp)).ravel(),
            y=(self.row[group] + step).ravel(),
            length=np.where(inside, last - first + 1, 0).astype(np.intp).ravel(),
            start=(first - middle).ravel(),
            depth=depth.ravel(),
            curvature=self.curvature[group],
        )


@dataclass(frozen=True, slots=True)
class _RowSpans:
    """Spans of n ellipses: each is the pixels of one row that lie in one ellipse.

    The first row of every ellipse comes first, then all second rows: span i is of ellipse i mod n.
    Arrays (rows · n,), ``curvature`` (n,).

    Attributes:
        x, y: First pixel, px; it may lie outside the frame.
        length: Number of pixels; 0 where an ellipse has no such row.
        start: From the row's middle to the centre of the first pixel, px.
        depth, curvature: 1 − q² = depth − curvature d², d px from the row's middle.
    """

    x: Index
    y: Index
    length: Index
    start: Single
    depth: Single
    curvature: Single

    def weights(self, some: Index) -> Single:
        """Return the weight (1 − q²)² of each pixel of ``some`` spans, (pixels, spans); it is 0
        beyond the end of a span."""
        longest = self.length.take(some).max()
        d = self.start.take(some) + np.arange(longest, dtype=np.float32)[:, None]
        d *= d
        d *= self.curvature.take(some % len(self.curvature))
        np.subtract(self.depth.take(some), d, out=d)
        np.maximum(d, 0, out=d)
        d *= d
        return d


def _clip_where(edge: Column, large: NDArray[np.bool_], low: float, high: float) -> Column:
    """Clip the ``edge`` of each ellipse that is ``large`` to low..high."""
    return np.where(large, np.clip(edge, low, high), edge)


def _batches(lengths: Index, areas: Index, batch_area: int) -> Iterator[Index]:
    """Yield the indices of all ``lengths`` > 0, sorted by them, in batches of equal area."""
    # Sorting 16-bit numbers is several times as fast, and the order need not be exact.
    order = np.argsort(np.minimum(lengths, np.iinfo(np.int16).max).astype(np.int16), kind="stable")
    order = order[np.count_nonzero(lengths <= 0) :]
    group = np.cumsum(areas.take(order)) // batch_area
    for part in np.split(order, np.flatnonzero(np.diff(group)) + 1):
        if part.size:
            yield part


def _add(
    canvas: NDArray[np.float32],
    spans: _RowSpans,
    some: NDArray[np.intp],
    weights: NDArray[np.float32],
    light: NDArray[np.float32],
) -> None:
    """Add ``some`` spans to a canvas (H, W, 3): ``weights`` (pixels, spans) times ``light``
    (3, flakes); weights of pixels outside the canvas become 0."""
    height, width = canvas.shape[:2]
    x, y, step = spans.x.take(some), spans.y.take(some), np.arange(len(weights))[:, None]
    pixel = y * width + x + step
    leaves = np.flatnonzero((x < 0) | (x + len(weights) > width) | (y < 0) | (y >= height))
    if leaves.size:
        x, y = x[leaves] + step, y[leaves]
        seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        weights[:, leaves] *= seen
        pixel[:, leaves] *= seen
    flake = some % light.shape[1]
    for plane, shine in zip(canvas.reshape(-1, 3).T, light, strict=True):
        if shine.any():  # most flakes have no blue
            np.add.at(plane, pixel.ravel(), (weights * shine.take(flake)).ravel())


def _ranges(
    first: NDArray[np.float64], last: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return, for every integer in the ranges first..last, the index of its range, and itself."""
    count = np.maximum(last - first + 1, 0).astype(np.intp)
    owner = np.repeat(np.arange(len(count)), count)
    before = first.astype(np.intp) - (np.cumsum(count) - count)
    return owner, before[owner] + np.arange(len(owner))
