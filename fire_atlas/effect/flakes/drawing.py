"""Draw flakes: additive sprites at sub-pixel positions, in linear light that may exceed 1.

A soft flake is a streak that fades towards its outline. Streaks whose boxes are about as wide are
drawn together, all rows of their boxes side by side, because numpy is only fast on long axes. Wide
and faint ones are drawn at a lower resolution, at which they look the same.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane
from fire_atlas.effect.flakes.layer import FAINTEST, FlakeLight, in_few_planes, ranges
from fire_atlas.effect.flakes.texture import TextureCells, draw_textured
from fire_atlas.effect.flakes.tracks import COLUMNS, by_column
from fire_atlas.vision.pixel_grid import PixelGrid
from fire_atlas.vision.warp import between_copies

Column = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.intp]

HALO_LIGHT, HALO_WIDTH = 0.004, 2.5
"""Light of the halo that the lens puts around a flake, and its width, relative to the flake's. One
width off the axis, filmed embers give some .25 % of their light; at two, next to nothing."""

SEEN_LENGTH = (1 - 0.214 ** (1 / 3)) ** (1 / 3)
"""Length at half of the brightness in the middle, as a fraction of the length as drawn."""

SPRITE_INTEGRAL = 16 / 35 * math.gamma(1 / 3) * math.gamma(9 / 2) / math.gamma(29 / 6) / 3
"""∫(1 − |u|³ − v²)³ over a sprite of length and width 1; u and v are 1 at the ends of its axes."""

_MAX_ERROR, _MIN_RADIUS = FAINTEST, 1.5
"""Light by which a streak may differ at a lower resolution from what it is at the frame's, and its
minimum radius there, px."""

_ERROR = 0.7
"""Largest difference of a streak whose radius is 1 px at a lower resolution, as measured, relative
to its light; it falls with the square of the radius."""

_MIN_WIDE_AREA = 1 / 3
"""Area of what could be drawn at lower resolutions, as a fraction of the frame's, below which that
takes longer than to draw all at the frame's own."""

_FADED = 1e-4
"""Light at which a streak or a halo ends: a quarter of a step, because the ends of many add up."""

_SHARPEN = np.array([-1 / 8, 10 / 8, -1 / 8], np.float32)
"""Filter, along each axis, that makes up for the blur of ``cv2.pyrUp``."""

_WIDTH_OF_PIXEL = 1.7
"""Width, px, that the area of a pixel adds to a sprite's. Sprites then are so wide that samples at
the centres of pixels, which players take, have about the light of the sprite."""

_BATCH = 3 << 14
"""Area, px², of boxes that are drawn together: small enough for the processor's cache, large enough
to be worth a numpy call."""

_LARGE = 8.0
"""Radius, px, from which the samples at pixel centres sum to a sprite's light closely enough.
Such streaks are clipped to the frame at once; small ones only after all pixels are summed."""

_GLOW_SIGMA = 0.018
"""Width (σ) of the glow that a recipe asks for, heights."""

_GLOW_REACH = 4.0
"""Distance at which a Gaussian has ended, standard deviations."""


def drawn_width(width: Column, art: PixelGrid | None) -> Column:
    """Return the width, px, at which sprites are drawn: one or two pixels of ``art``; None: soft.

    Soft ones are seen by pixels that are one px wide themselves.
    """
    if art is None:
        return width + _WIDTH_OF_PIXEL
    return art.side * np.clip(np.rint(width / art.side), 1, 2)


def draw_frame(
    rows: Column,
    height: int,
    width: int,
    hard: bool,
    texture: TextureCells | None = None,
    cells: NDArray[np.int64] | None = None,
    *,
    tiles: bool = False,
) -> FlakeLight:
    """Draw the flakes of one frame: soft streaks, ``hard`` squares, or cells of a texture.

    Args:
        rows: (flakes, columns) of the frame, as in ``Tracks.frames``.
        height, width: Frame, px.
        hard: Whether flakes are squares.
        texture: The picture that they show instead.
        cells: (flakes,), the cell of the texture that each shows.
        tiles: Whether what leaves the frame at one side enters at the other.
    """
    if tiles:
        return _draw_tile(rows, height, width, hard, texture, cells)
    if texture is not None and cells is not None:
        return draw_textured(rows, cells, texture, height, width)
    return (draw_pixels if hard else draw_flakes)(rows, height, width)


def _draw_tile(
    rows: Column,
    height: int,
    width: int,
    hard: bool,
    texture: TextureCells | None,
    cells: NDArray[np.int64] | None,
) -> FlakeLight:
    """Draw the flakes of a frame that lies between copies of itself, of which it shows some too."""
    column = by_column(rows)
    # Lower resolutions than the frame's are less exact near its border.
    margin = math.ceil(2 * column["size"].max(initial=0))
    reach = margin + column["size"] * (column["stretch"] + HALO_WIDTH)
    flake, copy = ranges(
        np.ceil((-reach - column["x"]) / width), np.floor((width + reach - column["x"]) / width)
    )
    copies = rows[flake]
    copies[:, COLUMNS.index("x")] += copy * width + margin
    shown = None if cells is None else cells[flake]
    light = draw_frame(copies, height, width + 2 * margin, hard, texture, shown)
    return replace(light, planes=light.planes[:, :, margin : margin + width].copy())


def draw_flakes(rows: Column, height: int, width: int) -> FlakeLight:
    """Draw the soft flakes of one frame with their halos, as ``Tracks`` states.

    The pixels of a small streak sum to its exact integral, wherever it lies between them.

    Args:
        rows: (flakes, 17), columns ``tracks.COLUMNS``.
        height, width: Frame, px.
    """
    light, colours = in_few_planes(rows)
    column = by_column(rows)
    radius = column["size"] / 2
    shapes = np.stack([
        column["x"], column["y"], radius * column["stretch"], radius,
        np.cos(column["rotation"]), np.sin(column["rotation"]), column["tail"],
    ])  # fmt: skip
    halos = shapes.copy()
    halos[2:4] += radius * (HALO_WIDTH - 1)
    shapes, light = np.hstack([shapes, halos]), np.hstack([light, light * HALO_LIGHT])
    peak = light.max(axis=0, initial=0)
    seen = np.flatnonzero(peak > FAINTEST)
    shapes, light, peak = shapes[:, seen], light[:, seen], peak[seen]
    end = np.minimum(_FADED / peak, 1) ** (1 / 3)
    level = _level(shapes[3], peak)
    wide = shapes[2:4, level > 0]
    if 4 * (wide[0] * wide[1]).sum() < _MIN_WIDE_AREA * height * width:
        level[:] = 0
    pyramid = _Pyramid.of(len(colours), height, width, 1 + int(level.max(initial=0)))
    _draw(pyramid, _Streaks.of(shapes, end, level, pyramid), light)
    return FlakeLight(pyramid.collapsed(), colours)


def draw_pixels(rows: Column, height: int, width: int) -> FlakeLight:
    """Draw the flakes of one frame as hard squares of ``size`` whole px.

    Where squares overlap, each channel is the brighter of both: a sum would be a new colour.
    """
    planes = np.zeros((3, height * width), np.float32)
    column = by_column(rows)
    side = column["size"].astype(np.intp)
    left = np.rint(column["x"] - side / 2)
    top = np.rint(column["y"] - side / 2)
    row_flake, row = ranges(top, top + side - 1)
    span, x = ranges(left[row_flake], (left + side - 1)[row_flake])
    flake, y = row_flake[span], row[span]
    seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    flake, pixel = flake[seen], (y[seen] * width + x[seen])
    for plane, name in zip(planes, "rgb", strict=True):
        shine = (column[name] * column["a"]).astype(np.float32)
        np.maximum.at(plane, pixel, shine[flake])
    return FlakeLight(planes.reshape(3, height, width), np.eye(3, dtype=np.float32))


def add_glow(light: FlakeLight, share: float, fades: bool, *, tiles: bool = False) -> FlakeLight:
    """Add a soft glow, ``share`` times as bright as the layer, to a flake layer.

    A glow that ``fades`` becomes 0 at the border of the frame. If the layer ``tiles``, it goes on
    from side to side.
    """
    _, height, width = light.planes.shape
    sigma = _GLOW_SIGMA * height
    down, across = (
        np.clip(np.minimum(np.arange(n), np.arange(n)[::-1]) / (2 * sigma), 0, 1) if ends
        else np.ones(n)
        for n, ends in ((height, fades), (width, fades and not tiles))
    )  # fmt: skip
    inside = as_plane(share * np.multiply.outer(down, across))
    margin = math.ceil(_GLOW_REACH * sigma) if tiles else 0
    own, glowing = slice(margin, margin + width), []
    for plane in light.planes:
        around = between_copies(plane, margin)
        glow = cv2.GaussianBlur(around, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
        glowing.append(plane + inside * glow[:, own])
    return FlakeLight(np.stack(glowing), light.colours)


def _level(radius: Column, light: Column) -> Index:
    """Return the level of the pyramid in which streaks of ``radius``, px, are drawn."""
    least = np.maximum(np.sqrt(light * (_ERROR / _MAX_ERROR)), _MIN_RADIUS)
    return np.maximum(np.log2(radius / least), 0).astype(np.intp)


@dataclass(frozen=True, slots=True)
class _Pyramid:
    """A frame at resolutions that halve from level to level.

    The first pixel of all levels has the same centre. Arrays (levels,), unless stated.

    Attributes:
        light: (planes, pixels) of all levels, one after another, the finest first.
        first: Index of the first pixel of each level.
        height, width: Size of each level, px.
    """

    light: Single
    first: Index
    height: Index
    width: Index

    @classmethod
    def of(cls, planes: int, height: int, width: int, levels: int) -> Self:
        """Return a dark pyramid."""
        scale = 1 << np.arange(levels)
        heights, widths = -(-height // scale), -(-width // scale)
        ends = np.cumsum(heights * widths)
        return cls(
            np.zeros((planes, ends[-1]), np.float32), ends - heights * widths, heights, widths
        )

    def collapsed(self) -> Single:
        """Return the light of all levels at the finest resolution, (planes, H, W).

        Just beyond the edge of a streak it may be less than 0, too little to be seen.
        """
        sizes = zip(self.height.tolist(), self.width.tolist(), strict=True)
        parts = np.split(self.light, self.first[1:], axis=1)
        levels = [part.reshape(-1, *size) for part, size in zip(parts, sizes, strict=True)]
        for fine, coarse in zip(levels[-2::-1], levels[:0:-1], strict=True):
            size = fine.shape[2], fine.shape[1]
            for plane, small in zip(fine, coarse, strict=True):
                # pyrUp blurs, with a variance of one pixel of its result.
                sharp = cv2.sepFilter2D(small, -1, _SHARPEN, _SHARPEN)
                cv2.add(plane, cv2.pyrUp(sharp, dstsize=size), dst=plane)
        return levels[0]


@dataclass(frozen=True, slots=True)
class _Streaks:
    """Streaks, each in a box of pixels. Arrays (streaks,).

    Attributes:
        rows, columns: Size of the box, px; large streaks have only what lies inside the frame.
        row, column: First pixel of the box, px.
        height, width: Size of the streak's level of the pyramid, px.
        first: Index in the pyramid of the first pixel of the box; it may lie outside the frame.
        inside: Number of columns, from the box's first one, inside the frame; 0 if any row is
            outside.
        integral: Sum to which the weights of the pixels are scaled, px²; 0 if they are not.
        shape: (8, streaks), single precision: place of the centre of the first pixel along the
            longer axis, from the middle, and along the shorter one, both 1 at the axes' ends; the
            changes of the first place from column to column and from row to row, and those of the
            second; light in the middle, and its increase along the longer axis.
    """

    rows: Index
    columns: Index
    row: Index
    column: Index
    height: Index
    width: Index
    first: Index
    inside: Index
    integral: Column
    shape: Single

    @classmethod
    def of(cls, shapes: Column, end: Column, level: Index, pyramid: _Pyramid) -> Self:
        """Return streaks.

        Args:
            shapes: (7, streaks): x, y, half length and radius in px, cosine and sine of the
                rotation, tail.
            end: (streaks,), least 1 − |u|³ − v², 0..1, at which each is drawn: 0 draws all of it.
            level: (streaks,), level in which each is drawn.
            pyramid: The frame.
        """
        scale = 1 / (1 << level)
        x, y, half, radius = shapes[:4] * scale
        shift = 0.5 - 0.5 * scale
        x, y, (cos, sin, tail) = x + shift, y + shift, shapes[4:]
        large = radius >= _LARGE
        height, width = pyramid.height.take(level), pyramid.width.take(level)
        length, thickness = half * (1 - end) ** (1 / 3), radius * (1 - end) ** 0.5
        column, columns = _covered(x, _extent(length * cos, thickness * sin), large, width)
        row, rows = _covered(y, _extent(length * sin, thickness * cos), large, height)
        dx, dy, middle = column + 0.5 - x, row + 0.5 - y, (1 + tail) / 2
        right, down = (cos / half, -sin / radius), (sin / half, cos / radius)
        values = (
            *(dx * in_x + dy * in_y for in_x, in_y in zip(right, down, strict=True)),
            right[0], down[0], right[1], down[1], middle, (1 - tail) / 2,
        )  # fmt: skip
        shape = np.empty((len(values), len(x)), np.float32)
        for line, value in zip(shape, values, strict=True):
            line[:] = value
        is_inside = (column >= 0) & (row >= 0) & (row + rows <= height)
        return cls(
            rows=rows,
            columns=np.where(rows > 0, columns, 0),
            row=row,
            column=column,
            height=height,
            width=width,
            first=pyramid.first.take(level) + row * width + column,
            inside=np.where(is_inside, width - column, 0),
            # Large ones need no correction, and could not be corrected where the frame clips them.
            integral=np.where(large, 0, 4 * SPRITE_INTEGRAL * middle * half * radius),
            shape=shape,
        )


def _extent(along: Column, across: Column) -> Column:
    """Return how far from its middle a sprite |u|³ + v² = 1 reaches along an axis of the frame.

    The result is up to a tenth more than that.

    ``along`` and ``across`` are how far the ends of its own axes are.
    """
    # The sprite lies in the rectangle around it, and in an ellipse that is 1.12 times as large.
    # Not by np.hypot, which takes three times as long.
    round_it = 1.12 * np.sqrt(along * along + across * across)
    extent = np.minimum(np.abs(along) + np.abs(across), round_it)
    return np.asarray(extent, np.float64)


def _covered(
    centre: Column, extent: Column, clipped: NDArray[np.bool_], length: Index
) -> tuple[Index, Index]:
    """Return the first pixel within ``extent`` of ``centre``, and how many there are; of those that
    are ``clipped``, only such as lie in 0..length − 1."""
    first = np.ceil(centre - 0.5 - extent).astype(np.intp)
    last = np.floor(centre - 0.5 + extent).astype(np.intp)
    first = np.where(clipped, np.maximum(first, 0), first)
    last = np.where(clipped, np.minimum(last, length - 1), last)
    return first, np.maximum(last - first + 1, 0)


def _draw(pyramid: _Pyramid, streaks: _Streaks, light: Column) -> None:
    """Add streaks to a pyramid; ``light`` (planes, streaks) is that at the head."""
    for group in _batches(streaks.columns, streaks.rows * streaks.columns):
        rows, columns = streaks.rows.take(group), int(streaks.columns[group[-1]])
        first, owner = np.cumsum(rows) - rows, np.repeat(np.arange(len(group)), rows)
        row, streak = np.arange(len(owner)) - first.take(owner), group.take(owner)
        weights = _weights(streaks.shape.take(streak, axis=1), row, columns)
        total = np.add.reduceat(weights.sum(axis=0), first)
        integral = streaks.integral.take(group)
        exact = np.where(integral > 0, integral / np.maximum(total, 1e-12), 1)
        pixel = _pixels(streaks, streak, row, weights)
        shines = as_plane(light[:, group] * exact)
        for plane, shine in zip(pyramid.light, shines, strict=True):
            if len(shines) == 1:
                weights *= shine.take(owner)
                np.add.at(plane, pixel, weights.ravel())
            elif shine.any():  # most flakes of a recipe's colours have no blue
                np.add.at(plane, pixel, (weights * shine.take(owner)).ravel())


def _weights(shape: Single, row: Index, columns: int) -> Single:
    """Return the weights of the pixels of rows of boxes, (columns, rows); 0 outside of streaks.

    Args:
        shape: (8, rows), as in ``_Streaks``, of the streak of each row.
        row: (rows,), number of the row in its box.
        columns: Number of pixels computed of each row.
    """
    along, across, along_right, along_down, across_right, across_down, middle, slope = shape
    down, right = as_plane(row), np.arange(columns, dtype=np.float32)[:, None]
    u = right * along_right
    u += along + down * along_down
    v = right * across_right
    v += across + down * across_down
    light = u * slope
    light += middle
    cube = np.abs(u)
    u *= u
    u *= cube
    v *= v
    u += v
    inside = np.subtract(np.float32(1), u, out=u)
    np.clip(inside, 0, 1, out=inside)  # several times as fast as np.maximum
    light *= inside
    inside *= inside
    light *= inside
    return as_plane(light)


def _pixels(streaks: _Streaks, streak: Index, row: Index, weights: Single) -> Index:
    """Return the index in the pyramid of each of ``weights`` (columns, rows), flat; those of pixels
    outside the frame become 0.

    Args:
        streaks: All streaks.
        streak: (rows,), index of the streak of each row.
        row: (rows,), number of the row in its box.
        weights: Changed in place.
    """
    right, width = np.arange(len(weights))[:, None], streaks.width.take(streak)
    pixel = right + (streaks.first.take(streak) + row * width)
    some = np.flatnonzero(streaks.inside.take(streak) < len(weights))
    if some.size:
        of = streak[some]
        x, y = streaks.column[of] + right, streaks.row[of] + row[some]
        seen = (x >= 0) & (x < width[some]) & (y >= 0) & (y < streaks.height[of])
        weights[:, some] *= seen
        pixel[:, some] *= seen
    return pixel.ravel()


def _batches(lengths: Index, areas: Index) -> Iterator[Index]:
    """Yield the indices of all ``lengths`` > 0, sorted by them, in batches of equal area."""
    # Sorting 16-bit numbers is several times as fast, and the order need not be exact.
    order = np.argsort(np.minimum(lengths, np.iinfo(np.int16).max).astype(np.int16), kind="stable")
    order = order[np.count_nonzero(lengths <= 0) :]
    group = np.cumsum(areas.take(order)) // _BATCH
    for part in np.split(order, np.flatnonzero(np.diff(group)) + 1):
        if part.size:
            yield part
