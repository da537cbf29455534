"""Draw flakes: additive sprites at sub-pixel positions, in linear light that may exceed 1.

A soft flake is a capsule, drawn in spans: a span is the pixels of one row inside it. Its ends are
computed in closed form, so that no pixel outside is touched. Capsules of similar size are drawn
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
from fire_atlas.effect.flakes.layer import FAINTEST, FlakeLight
from fire_atlas.effect.flakes.tracks import COLUMNS

Column = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.intp]

HALO_LIGHT, HALO_WIDTH = 0.004, 4
"""Light of the halo that the lens puts around a flake, and its width, relative to the flake's."""

_STRONG_HALO = 0.05
"""Light from which a halo is drawn pixel by pixel; others are drawn at half the resolution."""

_REACH_OF_PIXEL = math.sqrt(2)
"""Width, px, that the area of a pixel adds to a sprite's: its diagonal. Sprites then are so wide
that samples at the centres of pixels, which players take, have about the light of the sprite."""

_FLAKE_BATCH, _SPAN_BATCH = 1 << 16, 1 << 15
"""Area, px², of flakes, and of spans, that are drawn together: small enough for the processor's
cache, large enough to be worth a numpy call."""

_LARGE = 8.0
"""Radius, px, from which the samples at pixel centres sum to a sprite's light closely enough.
Such capsules are clipped to the frame at once; small ones only after all pixels are summed."""

_GLOW_SIGMA = 0.018
"""Width (σ) of the glow that a recipe asks for, heights."""


def drawn_width(width: Column, hard: bool) -> Column:
    """Return the width, px, at which sprites are drawn; ``hard`` ones become one or two px wide.

    Soft ones are seen by pixels that are one px wide themselves.
    """
    return np.clip(np.rint(width), 1, 2) if hard else width + _REACH_OF_PIXEL


def capsule_integral(length: Column, width: Column) -> Column:
    """Return ∫(1 − (2d/width)²)², px², over a capsule around a segment of ``length`` px."""
    return width * (length * (8 / 15) + width * (math.pi / 12))


def draw_frame(rows: Column, height: int, width: int, hard: bool) -> FlakeLight:
    """Draw the flakes of one frame, ``rows`` (flakes, columns), soft or ``hard`` ones."""
    return (draw_pixels if hard else draw_flakes)(rows, height, width)


def draw_flakes(rows: Column, height: int, width: int) -> FlakeLight:
    """Draw the soft flakes of one frame with their halos, as ``Tracks`` states.

    The pixels of a small capsule sum to its exact integral, wherever it lies between them.

    Args:
        rows: (flakes, 17), columns ``tracks.COLUMNS``.
        height, width: Frame, px.
    """
    light, colours = _in_few_planes(rows)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    radius = column["size"] / 2
    shapes = np.stack([
        column["x"], column["y"], radius * (column["stretch"] - 1), radius, column["rotation"],
        column["tail"],
    ])  # fmt: skip
    halos, halo_light = shapes.copy(), light * HALO_LIGHT
    halos[3] *= HALO_WIDTH
    halo_peak = halo_light.max(axis=0, initial=0)
    reach = np.sqrt(1 - np.sqrt(np.minimum(FAINTEST / np.maximum(halo_peak, 1e-12), 1)))
    strong = halo_peak > _STRONG_HALO
    planes = np.zeros((len(colours), height, width), np.float32)
    _draw(
        planes,
        np.hstack([shapes, halos[:, strong]]),
        np.hstack([light, halo_light[:, strong]]),
        np.concatenate([np.ones_like(radius), reach[strong]]),
    )
    weak = ~strong & (halo_peak > FAINTEST)
    if weak.any():
        half = np.zeros((len(colours), (height + 1) // 2, (width + 1) // 2), np.float32)
        halos[:4] /= 2
        halos[:2] += 0.25  # pyrUp puts a pixel's centre on that of every other pixel
        _draw(half, halos[:, weak], halo_light[:, weak], reach[weak])
        for plane, small in zip(planes, half, strict=True):
            plane += cv2.pyrUp(small, dstsize=(width, height))
    return FlakeLight(planes, colours)


def draw_pixels(rows: Column, height: int, width: int) -> FlakeLight:
    """Draw the flakes of one frame as hard squares of ``size`` whole px.

    Where squares overlap, each channel is the brighter of both: a sum would be a new colour.
    """
    planes = np.zeros((3, height * width), np.float32)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    side = column["size"].astype(np.intp)
    left = np.rint(column["x"] - side / 2)
    top = np.rint(column["y"] - side / 2)
    row_flake, row = _ranges(top, top + side - 1)
    span, x = _ranges(left[row_flake], (left + side - 1)[row_flake])
    flake, y = row_flake[span], row[span]
    seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    flake, pixel = flake[seen], (y[seen] * width + x[seen])
    for plane, name in zip(planes, "rgb", strict=True):
        shine = (column[name] * column["a"]).astype(np.float32)
        np.maximum.at(plane, pixel, shine[flake])
    return FlakeLight(planes.reshape(3, height, width), np.eye(3, dtype=np.float32))


def add_glow(light: FlakeLight, share: float, fades: bool) -> FlakeLight:
    """Add a soft glow, ``share`` times as bright as the layer, to a flake layer.

    A glow that ``fades`` becomes 0 at the border of the frame.
    """
    _, height, width = light.planes.shape
    sigma = _GLOW_SIGMA * height
    down, across = (
        np.clip(np.minimum(np.arange(n), np.arange(n)[::-1]) / (2 * sigma), 0, 1) if fades
        else np.ones(n)
        for n in (height, width)
    )  # fmt: skip
    inside = as_plane(share * np.multiply.outer(down, across))
    glowing = [
        plane + inside * cv2.GaussianBlur(plane, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
        for plane in light.planes
    ]
    return FlakeLight(np.stack(glowing), light.colours)


def _in_few_planes(rows: Column) -> tuple[Column, Single]:
    """Return the light of flakes in each plane, (planes, flakes), and the planes' colours.

    One plane, if all flakes have the same colour.
    """
    column = dict(zip(COLUMNS, rows.T, strict=True))
    rgb = np.stack([column[name] for name in "rgb"])
    brightest = rgb.max(axis=0, initial=0)
    hues = rgb / np.maximum(brightest, 1e-12)
    if (np.abs(hues - hues[:, :1]) < 1e-6).all() and hues.size:
        return brightest[None] * column["a"], as_plane(hues[:, :1].T)
    return rgb * column["a"], np.eye(3, dtype=np.float32)


def _draw(planes: Single, shapes: Column, light: Column, reach: Column) -> None:
    """Add capsules to planes (planes, H, W).

    Args:
        planes: Changed in place.
        shapes: (6, capsules): x, y, half length and radius in px, rotation in rad, tail.
        light: (planes, capsules), light at the head.
        reach: (capsules,), fraction of the radius up to which each is drawn.
    """
    visible = light.max(axis=0, initial=0) > FAINTEST
    light = light[:, visible]
    capsules = _Capsules.of(shapes[:, visible], reach[visible], planes.shape[1:])
    for group in _batches(capsules.rows, capsules.area, _FLAKE_BATCH):
        spans = capsules.spans(group)
        total = np.zeros(len(spans.length), np.float32)
        drawn = []
        for some in _batches(spans.length, spans.length, _SPAN_BATCH):
            weights = spans.weights(some)
            total[some] = weights.sum(axis=0)
            drawn.append((some, weights))
        total = total.reshape(-1, len(group)).sum(axis=0)
        # Large capsules need no correction, and could not be corrected where the frame clips them.
        exact = capsules.integral[group] / np.maximum(total, 1e-12)
        shine = as_plane(light[:, group] * np.where(capsules.radius[group] < _LARGE, exact, 1.0))
        for some, weights in drawn:
            _add(planes, spans, some, weights, shine)


@dataclass(frozen=True, slots=True)
class _Capsules:
    """Capsules: all points at most ``radius`` from a segment. Arrays (capsules,).

    Coordinates count from the pixel at the capsule's centre, so that single precision is exact
    enough.

    Attributes:
        column, row: Column of the centre, and first row covered, px.
        rows: Number of rows covered.
        area: About the area covered, px².
        offset_x: From the centre of pixel ``column`` to the capsule's centre, px.
        offset_y: From the capsule's centre to the centre of the first row, px.
        cos, sin: Of the direction from tail to head.
        half: Half the length of the segment, px.
        radius: Distance from the segment at which the light is 0, px.
        reach: Fraction of ``radius`` up to which the capsule is drawn.
        tail: Light at the tail, relative to that at the head.
        integral: Sum of the weights of all pixels that are drawn, px².
        first_column, last_column: Columns that may be covered, counted from ``column``.
    """

    column: Index
    row: Index
    rows: Index
    area: Index
    offset_x: Single
    offset_y: Single
    cos: Single
    sin: Single
    half: Single
    radius: Single
    reach: Single
    tail: Single
    integral: Single
    first_column: Single
    last_column: Single

    @classmethod
    def of(cls, shapes: Column, reach: Column, frame: tuple[int, ...]) -> Self:
        """Return capsules of ``shapes`` as for ``_draw``, in a ``frame`` (height, width)."""
        x, y, half, radius, rotation, tail = shapes
        cos, sin, drawn = np.cos(rotation), np.sin(rotation), radius * reach
        height = half * np.abs(sin) + drawn
        large = radius >= _LARGE
        top = _clip_where(np.ceil(y - 0.5 - height), large, 0, frame[0])
        end = _clip_where(np.floor(y + 0.5 + height), large, 0, frame[0])
        rows = np.maximum(end - top, 0)
        column = np.floor(x)
        edge = np.where(large, 0, np.inf)
        # ∫(1 − q²)² up to ``reach``, across the segment and over the two half discs at its ends.
        across = 2 * reach - 4 / 3 * reach**3 + 2 / 5 * reach**5
        disc = (1 - (1 - reach**2) ** 3) * (math.pi / 3)
        return cls(
            column=column.astype(np.intp),
            row=top.astype(np.intp),
            rows=rows.astype(np.intp),
            area=(rows + 4 * drawn * (half + drawn)).astype(np.intp),
            offset_x=as_plane(x - column - 0.5),
            offset_y=as_plane(top + 0.5 - y),
            cos=as_plane(cos),
            sin=as_plane(sin),
            half=as_plane(half),
            radius=as_plane(radius),
            reach=as_plane(reach),
            tail=as_plane(tail),
            integral=as_plane((1 + tail) / 2 * radius * (2 * half * across + radius * disc)),
            first_column=as_plane(-column - edge),
            last_column=as_plane(frame[1] - 1 - column + edge),
        )

    def spans(self, group: Index) -> "_RowSpans":
        """Return the spans of a group of capsules, for each as many rows as the tallest has."""
        step = np.arange(self.rows[group].max())[:, None]
        dy = self.offset_y[group] + as_plane(step)
        cos, sin, half = self.cos[group], self.sin[group], self.half[group]
        radius = self.radius[group] * self.reach[group]
        left, right, inside = _row_ends(dy, np.where(sin < 0, -cos, cos), np.abs(sin), half, radius)
        offset_x = self.offset_x[group]
        first = np.maximum(np.ceil(left + offset_x), self.first_column[group])
        last = np.minimum(np.floor(right + offset_x), self.last_column[group])
        inside &= step < self.rows[group]
        dx, unit = first - offset_x, as_plane(1 / self.radius[group])
        cos, sin, half = cos * unit, sin * unit, half * unit
        # Only one that is longer than nothing has a tail.
        slope = (1 - self.tail[group]) / np.maximum(2 * half, np.float32(1e-3))
        x = self.column[group] + first.astype(np.intp)
        y = self.row[group] + step
        length = np.where(inside, last - first + 1, 0).astype(np.intp)
        shape = np.empty((8, *first.shape), np.float32)
        values = (
            dx * cos + dy * sin, dy * cos - dx * sin, cos, sin, half, np.square(self.reach[group]),
            (1 + self.tail[group]) / 2, slope,
        )  # fmt: skip
        for column, value in zip(shape, values, strict=True):
            column[:] = value
        return _RowSpans(x.ravel(), y.ravel(), length.ravel(), shape.reshape(8, -1))


def _row_ends(
    dy: Single, cos: Single, sin: Single, half: Single, radius: Single
) -> tuple[Single, Single, NDArray[np.bool_]]:
    """Return where capsules begin and end on rows ``dy`` px below their centres, and whether they
    reach them at all, (rows, capsules); the ends are in px from their centres. ``sin`` >= 0.

    The end of a row touches the disc around one point of the segment: of all such discs, that which
    reaches furthest.
    """
    with np.errstate(divide="ignore"):
        steep = 1 / np.maximum(sin, np.float32(1e-6))
    ends, depths = [], []
    for side in (np.float32(-1), np.float32(1)):
        at = np.clip((dy + side * radius * cos) * steep, -half, half)
        depth = np.square(radius) - np.square(dy - at * sin)
        ends.append(at * cos + side * np.sqrt(np.maximum(depth, 0)))
        depths.append(depth)
    return ends[0], ends[1], np.minimum(*depths) > 0


@dataclass(frozen=True, slots=True)
class _RowSpans:
    """Spans of n capsules: each is the pixels of one row that lie in one capsule.

    The first row of every capsule comes first, then all second rows: span i is of capsule i mod n.
    Lengths are in radii. Arrays (rows · n,).

    Attributes:
        x, y: First pixel, px; it may lie outside the frame.
        length: Number of pixels; 0 where a capsule has no such row.
        shape: (8, rows · n): place of the first pixel's centre along the segment, from its middle,
            and across it; cosine and sine of the segment's direction, by which the place changes
            from pixel to pixel; half the segment's length; squared distance from it up to which
            the capsule is drawn; light at its middle, and the increase of light along it.
    """

    x: Index
    y: Index
    length: Index
    shape: Single

    def weights(self, some: Index) -> Single:
        """Return the weight of each pixel of ``some`` spans, (pixels, spans); it is 0 beyond the
        end of a span."""
        along, across, cos, sin, half, reach, middle, slope = self.shape.take(some, axis=1)
        step = np.arange(self.length.take(some).max(), dtype=np.float32)[:, None]
        at = step * cos
        at += along
        q = step * sin
        np.subtract(across, q, out=q)
        nearest = np.minimum(at, half)
        np.maximum(nearest, -half, out=nearest)
        at -= nearest
        at *= at
        q *= q
        q += at
        np.putmask(q, q >= reach, np.float32(1))
        np.subtract(np.float32(1), q, out=q)
        q *= q
        nearest *= slope
        nearest += middle
        q *= nearest
        return as_plane(q)


def _clip_where(edge: Column, large: NDArray[np.bool_], low: float, high: float) -> Column:
    """Clip the ``edge`` of each capsule that is ``large`` to low..high."""
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


def _add(planes: Single, spans: _RowSpans, some: Index, weights: Single, light: Single) -> None:
    """Add ``some`` spans to planes (planes, H, W): ``weights`` (pixels, spans) times ``light``
    (planes, flakes); weights of pixels outside the frame become 0."""
    height, width = planes.shape[1:]
    x, y, step = spans.x.take(some), spans.y.take(some), np.arange(len(weights))[:, None]
    pixel = step + (y * width + x)
    leaves = np.flatnonzero((x < 0) | (x + len(weights) > width) | (y < 0) | (y >= height))
    if leaves.size:
        x, y = x[leaves] + step, y[leaves]
        seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        weights[:, leaves] *= seen
        pixel[:, leaves] *= seen
    flake, pixel = some % light.shape[1], pixel.ravel()
    for plane, shine in zip(planes.reshape(len(planes), -1), light, strict=True):
        if shine.any():  # most flakes of a recipe's colours have no blue
            np.add.at(plane, pixel, (weights * shine.take(flake)).ravel())


def _ranges(
    first: NDArray[np.float64], last: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return, for every integer in the ranges first..last, the index of its range, and itself."""
    count = np.maximum(last - first + 1, 0).astype(np.intp)
    owner = np.repeat(np.arange(len(count)), count)
    before = first.astype(np.intp) - (np.cumsum(count) - count)
    return owner, before[owner] + np.arange(len(owner))
