"""Drawing flakes: additive sprites, sub-pixel, in linear light that may exceed 1.

Soft flakes are drawn in spans: the pixels of a row that lie in one ellipse. Spans are found in
closed form, so only pixels in an ellipse are touched. Arrays hold whole rows of ellipses of like
size at a time: numpy is fast along long axes only.
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
"""Area, px, of the flakes that are drawn together, and of their spans that are: little enough for
the processor's cache, and enough of one size to be worth a call."""

_LARGE = 8.0
"""Half width, px, from which pixel centres sample a sprite as well as its integral: such ellipses
are cut at the frame at once, small ones only when all their pixels are weighed."""

_HALO_SIGMA = 0.018
"""Width (σ) of a halo, heights."""

_MIN_WIDTH = 2.6
"""Width, px, of the smallest soft sprite that a pixel grid still shows without flicker."""


def drawn_width(width: NDArray[np.float64], hard: bool) -> NDArray[np.float64]:
    """Return the width, px, at which sprites are drawn: ``hard`` ones are one or two px wide."""
    return np.clip(np.rint(width), 1, 2) if hard else np.maximum(width, _MIN_WIDTH)


def draw_flakes(rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Draw the soft flakes of one frame on black: linear light (height, width, 3).

    Each row is a soft ellipse (1 − q²)² with q² = (2a/(size·stretch))² + (2b/size)², a along its
    rotation and b across; rgb·a is the light at its centre. Each ellipse gives exactly the light
    of its integral, however it falls on the pixels.

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
        # Pixels stand for large ellipses as they are, and these may reach out of the frame.
        exact = np.where(across[group] < _LARGE, integral[group] / np.maximum(total, 1e-12), 1.0)
        shine = as_plane(light[:, group] * exact)
        for some, weights in drawn:
            _add(canvas, spans, some, weights, shine)
    return canvas


def draw_pixels(rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Draw the flakes of one frame as hard squares of ``size`` whole px: light (height, width, 3).

    Where squares meet, the brighter channel shows: light does not add up to new colours.
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
    """Add a soft halo of ``share`` times its light to a flake layer (H, W, 3).

    A halo that ``fades`` is dark at the border of the frame.
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

    Single precision counts from the pixel that holds an ellipse's middle, and is exact enough
    there. Along a row 1 − q² = depth − p (x − middle)².

    Attributes:
        column, row: Pixel of the middle, and first row covered, px.
        rows: Rows covered.
        area: Of the box around, px².
        offset_x, offset_y: Way from the centre of that pixel to the middle, and from the middle to
            the centre of the first row, px.
        curvature: p.
        slope: By how much a row's middle moves to the left, px a row: r / p.
        depth_loss: How fast depth falls, s − r² / p.
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
        """Return the spans of a group of ellipses, as many rows of each as the tallest has."""
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
    """Spans of n ellipses: the pixels of one row that lie in one of them.

    Spans of all first rows come before those of the second: span i is of ellipse i mod n. Arrays
    (rows · n,), ``curvature`` (n,).

    Attributes:
        x, y: First pixel, px; it may lie outside the frame.
        length: Pixels; 0 where an ellipse has no such row.
        start: From the row's middle to the centre of the first pixel, px.
        depth, curvature: 1 − q² in the row's middle, and how fast it falls from there.
    """

    x: Index
    y: Index
    length: Index
    start: Single
    depth: Single
    curvature: Single

    def weights(self, some: Index) -> Single:
        """Return the weight (1 − q²)² of each pixel of ``some`` spans, (pixels, spans); 0 past the
        end of the shorter ones."""
        longest = self.length.take(some).max()
        d = self.start.take(some) + np.arange(longest, dtype=np.float32)[:, None]
        d *= d
        d *= self.curvature.take(some % len(self.curvature))
        np.subtract(self.depth.take(some), d, out=d)
        np.maximum(d, 0, out=d)
        d *= d
        return d


def _clip_where(edge: Column, large: NDArray[np.bool_], low: float, high: float) -> Column:
    """Clip the edges of large ellipses to low..high."""
    return np.where(large, np.clip(edge, low, high), edge)


def _batches(lengths: Index, areas: Index, most: int) -> Iterator[Index]:
    """Yield the indices of what has a length, in its order, in batches of about ``most`` area."""
    # A sort of 16-bit numbers is several times as fast, and it need not be exact.
    order = np.argsort(np.minimum(lengths, np.iinfo(np.int16).max).astype(np.int16), kind="stable")
    order = order[np.count_nonzero(lengths <= 0) :]
    group = np.cumsum(areas.take(order)) // most
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
    (3, flakes); the weights of what falls outside become 0."""
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
    """Return all integers of the ranges first..last, after the index of the range of each."""
    count = np.maximum(last - first + 1, 0).astype(np.intp)
    owner = np.repeat(np.arange(len(count)), count)
    before = first.astype(np.intp) - (np.cumsum(count) - count)
    return owner, before[owner] + np.arange(len(owner))
