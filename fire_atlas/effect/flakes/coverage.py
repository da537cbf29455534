"""How soft ellipses cover the pixels: in spans, the pixels of a row that lie in one ellipse.

Spans are found in closed form, so only pixels in an ellipse are touched. Arrays are laid out with
like beside like, whole rows of ellipses at a time: numpy is fast along long axes only.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane

Column = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.intp]

LARGE = 8.0
"""Half width, px, from which pixel centres sample a sprite as well as its integral: such ellipses
are cut at the frame here, small ones only once all their pixels are weighed."""


def alike(lengths: Index, areas: Index, most: int) -> Iterator[Index]:
    """Yield the indices of what has a length, ascending, in groups of ``most`` of area or so."""
    # A sort of 16-bit numbers is several times as fast, and it need not be exact.
    order = np.argsort(np.minimum(lengths, np.iinfo(np.int16).max).astype(np.int16), kind="stable")
    order = order[np.count_nonzero(lengths <= 0) :]
    group = np.cumsum(areas.take(order)) // most
    for part in np.split(order, np.flatnonzero(np.diff(group)) + 1):
        if part.size:
            yield part


@dataclass(frozen=True, slots=True)
class Ellipses:
    """Soft ellipses (1 − q²)², q² = p dx² + 2 r dx dy + s dy². Arrays (ellipses,).

    Single precision counts from the pixel that holds an ellipse's middle, and is exact enough
    there. Along a row 1 − q² = depth − p (x − middle)².

    Attributes:
        column, row: Pixel of the middle, and first row covered, px.
        rows: Rows covered.
        area: Of the box around, px².
        right, down: From the centre of that pixel to the middle, from the middle to the centre of
            the first row, px.
        bend: p.
        slope: By how much a row's middle moves to the left, px a row: r / p.
        drop: How fast depth falls, s − r² / p.
        least, most: First and last column that may be covered, counted from ``column``.
    """

    column: Index
    row: Index
    rows: Index
    area: Index
    right: Single
    down: Single
    bend: Single
    slope: Single
    drop: Single
    least: Single
    most: Single

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
        large = across >= LARGE
        top = _held(np.ceil(y - 0.5 - height), large, 0, frame[0])
        end = _held(np.floor(y + 0.5 + height), large, 0, frame[0])
        column = np.floor(x)
        edge = np.where(large, 0, np.inf)
        return cls(
            column=column.astype(np.intp),
            row=top.astype(np.intp),
            rows=np.maximum(end - top, 0).astype(np.intp),
            area=(np.maximum(end - top, 0) * (2 * along + 1)).astype(np.intp),
            right=as_plane(x - column - 0.5),
            down=as_plane(top + 0.5 - y),
            bend=as_plane(p),
            slope=as_plane(r / p),
            drop=as_plane(1 / (p * product**2)),
            least=as_plane(-column - edge),
            most=as_plane(frame[1] - 1 - column + edge),
        )

    def spans(self, group: Index) -> "Spans":
        """Return the spans of some of the ellipses, as many rows of each as the highest has."""
        step = np.arange(self.rows[group].max())[:, None]
        dy = self.down[group] + as_plane(step)
        depth = 1 - self.drop[group] * dy * dy
        middle = self.right[group] - self.slope[group] * dy
        half = np.sqrt(np.maximum(depth, 0) / self.bend[group])
        first = np.maximum(np.ceil(middle - half), self.least[group])
        last = np.minimum(np.floor(middle + half), self.most[group])
        inside = (depth > 0) & (step < self.rows[group])
        return Spans(
            x=(self.column[group] + first.astype(np.intp)).ravel(),
            y=(self.row[group] + step).ravel(),
            length=np.where(inside, last - first + 1, 0).astype(np.intp).ravel(),
            start=(first - middle).ravel(),
            depth=depth.ravel(),
            bend=self.bend[group],
        )


@dataclass(frozen=True, slots=True)
class Spans:
    """Rows of n ellipses, those of the first row before those of the second: span i is of ellipse
    i mod n. Arrays (rows · n,), ``bend`` (n,).

    Attributes:
        x, y: First pixel, px; it may lie outside the frame.
        length: Pixels; 0 where an ellipse has no such row.
        start: From the row's middle to the centre of the first pixel, px.
        depth, bend: 1 − q² in the row's middle, and how fast it falls from there.
    """

    x: Index
    y: Index
    length: Index
    start: Single
    depth: Single
    bend: Single

    def weights(self, some: Index) -> Single:
        """Return the weight (1 − q²)² of each pixel of ``some`` spans, (pixels, spans); 0 past the
        end of the shorter ones."""
        longest = self.length.take(some).max()
        d = self.start.take(some) + np.arange(longest, dtype=np.float32)[:, None]
        d *= d
        d *= self.bend.take(some % len(self.bend))
        np.subtract(self.depth.take(some), d, out=d)
        np.maximum(d, 0, out=d)
        d *= d
        return d


def _held(edge: Column, large: NDArray[np.bool_], least: float, most: float) -> Column:
    return np.where(large, np.clip(edge, least, most), edge)
