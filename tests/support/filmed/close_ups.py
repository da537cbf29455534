"""Measure flakes one by one, as in a picture of each alone: colour, size, halo, light.

Many are drawn at once, each in a cell of its own, and all cells are measured together. Embers in
footage are measured in the same way, so that both can be compared (``filmed.py``).
"""

from dataclasses import dataclass, fields
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Bytes, as_plane, decode_bytes, encode_bytes, expose
from fire_atlas.effect.flakes.drawing import HALO_WIDTH, draw_flakes
from fire_atlas.effect.flakes.tracks import COLUMNS, by_column
from fire_atlas.vision.warp import sample_at

Values = NDArray[np.float64]
"""(flakes,), or (flakes, n) where stated."""

HEIGHT = 320
"""Height of the frames, px, to which flakes are scaled before they are measured."""

SEEN = 26
"""Value, of 255, above which a pixel stands out from the background."""

_CORE, _RIM = 0.85, 12
"""Share of a flake's peak from which a pixel belongs to its core; least value of one of its rim."""

_SIDES = (32, 64, 128, 256, 512)
"""Sides of cells, px; flakes that need a larger one are left out."""

_CANVAS = 1024
"""Width and height of the pictures in which cells are drawn, px."""

_STEP = 0.25
"""Distance, px, of the samples of a profile."""

_HALO_AT = (1.0, 1.5, 2.5)
"""Distances from the axis at which halos are measured, in widths."""


@dataclass(frozen=True, slots=True)
class CloseUps:
    """Measures of flakes drawn over black in frames ``HEIGHT`` px high; NaN where there is none.

    Attributes:
        peak: Brightest value, 0..255.
        area: Number of pixels brighter than ``SEEN``.
        core: (flakes, 3), mean R, G, B of the pixels near the peak, 0..255.
        rim: (flakes, 3), mean R, G, B of pixels 1-2 px outside of half the peak, 0..255.
        width, length: Full width at half of the peak, px, across the flake and along it.
        halves: Light of the weaker half of its length over that of the stronger half.
        halo: (flakes, 3), light at ``_HALO_AT`` widths off the axis over that on the axis.
        light: Sum of the linear light of its pixels.
    """

    peak: Values
    area: Values
    core: Values
    rim: Values
    width: Values
    length: Values
    halves: Values
    halo: Values
    light: Values

    @classmethod
    def of(cls, rows: Values, height: int) -> Self:
        """Draw and measure the flakes of ``rows`` (flakes, columns) in frames of ``height`` px."""
        scaled = _scaled(rows, HEIGHT / height)
        column = by_column(scaled)
        # The halo must not light another cell.
        extent = column["size"] * (column["stretch"] + HALO_WIDTH) + 8
        side = np.array([*_SIDES, 0])[np.searchsorted(_SIDES, extent)]
        parts, order = [], []
        for each in _SIDES:
            some = np.flatnonzero(side == each)
            batch = (_CANVAS // each) ** 2
            for of_batch in np.split(some, range(batch, len(some), batch)):
                if of_batch.size:
                    parts.append(_measured(_Sheet.of(scaled[of_batch], each)))
                    order.append(of_batch)
        if not parts:
            return cls(**{name: np.zeros((0, *shape)) for name, shape in _SHAPES.items()})
        place = np.argsort(np.concatenate([*order, np.flatnonzero(side == 0)]))
        missing = {
            name: np.full((int((side == 0).sum()), *shape), np.nan)
            for name, shape in _SHAPES.items()
        }
        return cls(**{
            name: np.concatenate([*(part[name] for part in parts), missing[name]])[place]
            for name in _SHAPES
        })  # fmt: skip

    def seen(self) -> NDArray[np.bool_]:
        """Return which flakes stand out from the background."""
        return np.asarray((self.peak > SEEN) & (self.area >= 3))

    def where(self, chosen: NDArray[np.bool_]) -> Self:
        """Return the measures of the ``chosen`` flakes."""
        return type(self)(*(getattr(self, field.name)[chosen] for field in fields(self)))


_SHAPES: dict[str, tuple[int, ...]] = {
    "peak": (), "area": (), "core": (3,), "rim": (3,), "width": (), "length": (), "halves": (),
    "halo": (3,), "light": (),
}  # fmt: skip


def _scaled(rows: Values, factor: float) -> Values:
    scaled = rows.copy()
    for name in ("x", "y", "vx", "vy", "size"):
        scaled[:, COLUMNS.index(name)] *= factor
    return scaled


@dataclass(frozen=True, slots=True)
class _Sheet:
    """Pictures of flakes, each in a square cell.

    Attributes:
        count: Number of flakes.
        side: Side of the cells, px.
        shown: (H, W, 3), what film shows of all cells.
        value: (H, W), its brightest channel.
        light: (H, W), the sum of its linear R, G and B.
    """

    count: int
    side: int
    shown: Bytes
    value: NDArray[np.uint8]
    light: NDArray[np.float32]

    @classmethod
    def of(cls, rows: Values, side: int) -> "_Sheet":
        across = min(len(rows), _CANVAS // side)
        down = -(-len(rows) // across)
        row, column = np.divmod(np.arange(len(rows)), across)
        placed = rows.copy()
        for name, cell in (("x", column), ("y", row)):
            at = COLUMNS.index(name)
            placed[:, at] = placed[:, at] % 1 + cell * side + side // 2
        shown = encode_bytes(expose(draw_flakes(placed, down * side, across * side).rgb()))
        red, green, blue = (decode_bytes(shown[..., channel]) for channel in range(3))
        return cls(len(rows), side, shown, brightest(shown), as_plane(red + green + blue))

    def cells(self, picture: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return the cells (flakes, side, side, ...) of a picture of the sheet (H, W, ...)."""
        down, across = (length // self.side for length in picture.shape[:2])
        split = picture.reshape(down, self.side, across, self.side, *picture.shape[2:])
        return split.swapaxes(1, 2).reshape(-1, self.side, self.side, *picture.shape[2:])[
            : self.count
        ]

    def corners(self) -> tuple[Values, Values]:
        """Return the x and y of the first pixel of each cell, px."""
        row, column = np.divmod(np.arange(self.count), self.shown.shape[1] // self.side)
        return column * float(self.side), row * float(self.side)


def _measured(sheet: _Sheet) -> dict[str, Values]:
    cells = np.asarray(sheet.cells(sheet.value), np.float32)
    peak = cells.max(axis=(1, 2))
    seen = cells > SEEN
    half = (cells >= 0.5 * peak[:, None, None]) & seen
    light = np.asarray(sheet.cells(sheet.light))
    return {
        "peak": peak.astype(np.float64),
        "area": seen.sum(axis=(1, 2)).astype(np.float64),
        "core": _mean_colour(sheet, (cells >= _CORE * peak[:, None, None]) & seen, 1),
        "rim": _mean_colour(sheet, _ring_around(half) & (cells > _RIM), 3),
        "light": np.einsum("nij,nij->n", light, seen).astype(np.float64),
        **_profiles(sheet, cells, half),
    }


def _mean_colour(sheet: _Sheet, mask: NDArray[np.bool_], least: int) -> Values:
    """Return the mean R, G, B (flakes, 3) of ``mask`` (flakes, side, side), if it has ``least``."""
    colour = np.asarray(sheet.cells(sheet.shown), np.float32)
    total = np.einsum("nijc,nij->nc", colour, mask.astype(np.float32))
    count = mask.sum(axis=(1, 2))[:, None]
    return np.where(count >= least, total / np.maximum(count, 1), np.nan)


def _ring_around(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the pixels within 2 px of ``mask`` (flakes, side, side) that are not in it."""
    flat = mask.reshape(-1, mask.shape[2]).view(np.uint8)
    wide = cv2.dilate(flat, np.ones((5, 5), np.uint8)).reshape(mask.shape)
    return np.asarray((wide > 0) & ~mask)


def _profiles(
    sheet: _Sheet, cells: NDArray[np.float32], half: NDArray[np.bool_]
) -> dict[str, Values]:
    """Return what is measured along lines through the middle of each flake."""
    (x, y), angle = _middle_and_angle(cells * half)
    left, top = sheet.corners()
    value = as_plane(sheet.value)

    def along(picture: NDArray[np.float32], turn: float, reach: float) -> NDArray[np.float32]:
        steps = np.arange(-reach, reach + _STEP / 2, _STEP)
        rows = (top + y)[:, None] + steps * np.sin(angle + turn)[:, None]
        columns = (left + x)[:, None] + steps * np.cos(angle + turn)[:, None]
        return sample_at(picture, columns, rows, border=cv2.BORDER_CONSTANT)

    reach = min(60.0, sheet.side / 2)
    across = along(value, np.pi / 2, min(14.0, reach))
    level = _near_middle(across) / 2
    width, _ = _extent(across, level)
    lengthwise, inside = _extent(along(value, 0.0, reach), level)
    return {
        "width": width,
        "length": np.maximum(lengthwise, width),
        "halves": _halves(along(sheet.light, 0.0, reach) * inside),
        "halo": _halo(along(sheet.light, np.pi / 2, min(14.0, reach)), width),
    }


def _middle_and_angle(weights: NDArray[np.float32]) -> tuple[tuple[Values, Values], Values]:
    """Return the centroid (x, y), px of the cell, and the angle of the longer axis of each cell."""
    at = np.arange(weights.shape[1], dtype=np.float64)
    total = np.maximum(weights.sum(axis=(1, 2), dtype=np.float64), 1e-9)
    over_x, over_y = weights.sum(axis=1), weights.sum(axis=2)
    x, y = over_x @ at / total, over_y @ at / total
    xx, yy = over_x @ at**2 / total - x**2, over_y @ at**2 / total - y**2
    xy = np.einsum("nij,i,j->n", weights, at, at, optimize=True) / total - x * y
    return (x, y), np.asarray(0.5 * np.arctan2(2 * xy, xx - yy))


def _near_middle(profile: NDArray[np.float32]) -> Values:
    """Return the highest value (flakes,) within 1 px of the middle of each profile."""
    middle, reach = profile.shape[1] // 2, round(1 / _STEP)
    near = profile[:, middle - reach : middle + reach + 1].max(axis=1)
    return np.asarray(near, np.float64)


def _extent(profile: NDArray[np.float32], level: Values) -> tuple[Values, NDArray[np.bool_]]:
    """Return the length, px, around the middle in which a profile is not below ``level``; and where

    that is, (flakes, samples).
    """
    middle, above = profile.shape[1] // 2, profile >= level[:, None]
    after = np.logical_and.accumulate(above[:, middle + 1 :], axis=1)
    before = np.logical_and.accumulate(above[:, middle - 1 :: -1], axis=1)[:, ::-1]
    inside = np.hstack([before, np.ones((len(profile), 1), bool), after])
    return inside.sum(axis=1) * _STEP, inside


def _halves(light: NDArray[np.float32]) -> Values:
    """Return the weaker half over the stronger one of light along flakes, 0 outside of them."""
    first, last = (light > 0).argmax(axis=1), light.shape[1] - (light > 0)[:, ::-1].argmax(axis=1)
    is_first = np.arange(light.shape[1]) < ((first + last) / 2)[:, None]
    one, other = (light * is_first).sum(axis=1), (light * ~is_first).sum(axis=1)
    return np.asarray(np.minimum(one, other) / np.maximum(np.maximum(one, other), 1e-9), np.float64)


def _halo(light: NDArray[np.float32], width: Values) -> Values:
    """Return the light off the axis (flakes, 3), by a profile of light across each flake."""
    middle, axis = light.shape[1] // 2, np.maximum(_near_middle(light), 1e-9)
    flake, found = np.arange(len(light)), []
    for distance in _HALO_AT:
        off = np.rint(distance * width / _STEP).astype(np.intp)
        inside = np.minimum(off, middle)
        weaker = np.minimum(light[flake, middle - inside], light[flake, middle + inside])
        found.append(np.where(off <= middle, weaker / axis, np.nan))
    return np.stack(found, axis=1)
