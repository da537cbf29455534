"""A picture with which flakes are drawn instead of as streaks, turned with their velocity.

Kim & Lee scale and rotate a texture by the velocity of the field (section III-C, Figure 9); this
one may be painted by the user, in one cell or several.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.pixels import as_plane
from fire_atlas.effect.flakes.layer import FAINTEST, FlakeLight, in_few_planes, ranges
from fire_atlas.effect.flakes.tracks import Table, by_column

MIN_WIDTH = 2**0.5
"""Minimum width, px, at which a texture is drawn: the diagonal of a pixel."""

MAX_SAMPLES = 4
"""Maximum number of samples along each side of a pixel, where a texture is drawn smaller."""

WHITEST = 254 / 255
"""The most that is shown of a painted texture, linear: film needs infinite light for white."""

_BATCH = 1 << 18
"""Number of samples that are taken together, to limit memory."""


@dataclass(frozen=True, slots=True)
class TextureCells:
    """The cells of a texture, as the pages have them.

    Attributes:
        light: (cells, h, w, channels) float32, 0..1, linear: what each pixel shows over black. The
            right side is the head of a flake. Three channels: it is shown in its own colours. One,
            the brightest of its colours: it is a mask of the flake's own light.
        over_life: Whether a flake shows all cells one after the other; if not, one drawn by lot.
    """

    light: NDArray[np.float32]
    over_life: bool

    @property
    def tinted(self) -> bool:
        """Whether it is a mask of the flake's own light."""
        return bool(self.light.shape[3] == 1)

    @property
    def aspect(self) -> float:
        """Width of a cell over its height."""
        _, height, width, _ = self.light.shape
        return float(width / height)

    def cells_of(self, rows: Table, seed: int) -> NDArray[np.int64]:
        """Return the number of the cell that each flake of ``rows`` shows, (rows,).

        ``rows`` have the columns of ``Tracks.frames`` and the ids of spawns.
        """
        count = len(self.light)
        column = by_column(rows)
        if self.over_life:
            part = column["age"] / column["life"]
            return np.asarray(np.clip((part * count).astype(np.int64), 0, count - 1))
        ids = column["id"].astype(np.int64)
        lots = generator(seed, RandomStream.TEXTURE_CELLS)
        return np.asarray(lots.integers(count, size=int(ids.max(initial=-1)) + 1)[ids])


def draw_textured(
    rows: Table, cells: NDArray[np.int64], texture: TextureCells, height: int, width: int
) -> FlakeLight:
    """Draw the flakes of one frame with a texture.

    A cell fills a rectangle of ``size`` · ``stretch`` by ``size`` px around (x, y), its right side
    in the direction of ``rotation``. With w its bilinear value at a pixel, 0 beyond its edges, the
    light of a flake is rgb·a·w if w is a mask. If w has colours, rgb·a·w is what is shown, and the
    light is that over 1 − that.

    Where a pixel covers several of the cell's, w is the mean of up to ``MAX_SAMPLES``² samples.

    Args:
        rows: (flakes, columns), as in ``Tracks.frames``.
        cells: (flakes,), the cell that each shows.
        texture: The picture.
        height, width: Frame, px.
    """
    column = by_column(rows)
    rgb = np.stack([column[name] * column["a"] for name in "rgb"])
    light, colours = in_few_planes(rows) if texture.tinted else (rgb, np.eye(3, dtype=np.float32))
    planes = np.zeros((len(colours), height * width), np.float32)
    sampler = _Sampler.of(texture)
    samples = sampler.samples(column["size"], column["stretch"])
    seen = rgb.max(axis=0, initial=0) > FAINTEST
    for side in range(1, MAX_SAMPLES + 1):
        for some in _batches(np.flatnonzero(seen & (samples == side)), column, side):
            flake, pixel, shown = sampler.shown(rows[some], cells[some], side, height, width)
            parts = light[:, some].take(flake, axis=1) * shown
            if not texture.tinted:
                parts = np.minimum(parts, WHITEST)
                parts /= 1 - parts
            for plane, part in zip(planes, as_plane(parts), strict=True):
                np.add.at(plane, pixel, part)
    return FlakeLight(planes.reshape(-1, height, width), colours)


def _batches(
    flakes: NDArray[np.intp], column: dict[str, Table], side: int
) -> list[NDArray[np.intp]]:
    """Split ``flakes`` (indices) into parts that take about as many samples each."""
    area = (column["size"] + 2) * (column["size"] * column["stretch"] + 2)
    group = np.cumsum(area[flakes] * side**2) // _BATCH
    return [part for part in np.split(flakes, np.flatnonzero(np.diff(group)) + 1) if part.size]


@dataclass(frozen=True, slots=True)
class _Sampler:
    """The cells with a dark border of one pixel, one below the other.

    Attributes:
        values: (channels, pixels), row by row.
        width, height: Size of a cell without its border, px.
    """

    values: NDArray[np.float32]
    width: int
    height: int

    @classmethod
    def of(cls, texture: TextureCells) -> Self:
        """Put a border around each cell."""
        padded = np.pad(texture.light, ((0, 0), (1, 1), (1, 1), (0, 0)))
        _, height, width, channels = texture.light.shape
        return cls(np.ascontiguousarray(padded.reshape(-1, channels).T), width, height)

    def samples(self, size: Table, stretch: Table) -> NDArray[np.int64]:
        """Return the number of samples along a pixel's side, (flakes,): one per px of the cell."""
        finest = np.maximum(self.height / size, self.width / (size * stretch))
        return np.asarray(np.clip(np.ceil(finest - 1e-3), 1, MAX_SAMPLES), np.int64)

    def shown(
        self, rows: Table, cells: NDArray[np.int64], side: int, height: int, width: int
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
        """Return for each pixel that a flake touches: the flake, the pixel, and the value w.

        Indices (pixels,) of ``rows`` and of the frame, flat; w (channels, pixels), the mean of
        ``side``² samples.
        """
        column = by_column(rows)
        cos, sin = np.cos(column["rotation"]), np.sin(column["rotation"])
        long, wide = column["size"] * column["stretch"] / 2, column["size"] / 2
        # The bilinear value ends half a pixel of the cell beyond its edges.
        reach_u, reach_v = long * (1 + 1 / self.width), wide * (1 + 1 / self.height)
        reach_x = reach_u * np.abs(cos) + reach_v * np.abs(sin) + 0.5
        reach_y = reach_u * np.abs(sin) + reach_v * np.abs(cos) + 0.5
        top = np.maximum(np.floor(column["y"] - reach_y), 0)
        bottom = np.minimum(np.ceil(column["y"] + reach_y), height) - 1
        left = np.maximum(np.floor(column["x"] - reach_x), 0)
        right = np.minimum(np.ceil(column["x"] + reach_x), width) - 1
        of_row, y = ranges(top, bottom)
        span, x = ranges(left[of_row], right[of_row])
        flake, y = of_row[span], y[span]
        dx, dy = x + 0.5 - column["x"][flake], y + 0.5 - column["y"][flake]
        # Pixels of the cell per pixel of the frame, along the flake and across it.
        fine_u, fine_v = self.width / (2 * long), self.height / (2 * wide)
        along = np.stack([cos * fine_u, sin * fine_u])[:, flake]
        across = np.stack([-sin * fine_v, cos * fine_v])[:, flake]
        u = dx * along[0] + dy * along[1] + (self.width - 1) / 2
        v = dx * across[0] + dy * across[1] + (self.height - 1) / 2
        margin_u = 1 + np.abs(along).sum(axis=0) / 2
        margin_v = 1 + np.abs(across).sum(axis=0) / 2
        inside = (u > -margin_u) & (u < self.width - 1 + margin_u)
        inside &= (v > -margin_v) & (v < self.height - 1 + margin_v)
        flake, pixel, u, v = flake[inside], (y * width + x)[inside], u[inside], v[inside]
        along, across = along[:, inside], across[:, inside]
        first = cells[flake] * (self.height + 2)
        total = np.zeros((len(self.values), len(pixel)), np.float32)
        offsets = (np.arange(side) + 0.5) / side - 0.5
        for down in offsets:
            for over in offsets:
                total += self.at(
                    first,
                    u + over * along[0] + down * along[1],
                    v + over * across[0] + down * across[1],
                )
        return flake, pixel, total / np.float32(side * side)

    def at(
        self, first: NDArray[np.int64], u: NDArray[np.float64], v: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return bilinear values (channels, places).

        Args:
            first: (places,), number of the first row of the cell.
            u, v: (places,), column and row in the cell; 0 is the centre of its first pixel.
        """
        u, v = np.clip(u, -1, self.width) + 1, np.clip(v, -1, self.height) + 1
        column = np.minimum(u.astype(np.intp), self.width)
        row = np.minimum(v.astype(np.intp), self.height)
        right, below = as_plane(u - column), as_plane(v - row)
        corner, line = (first + row) * (self.width + 2) + column, self.width + 2
        upper = self.values.take(corner, axis=1) * (1 - right)
        upper += self.values.take(corner + 1, axis=1) * right
        lower = self.values.take(corner + line, axis=1) * (1 - right)
        lower += self.values.take(corner + line + 1, axis=1) * right
        return as_plane(upper * (1 - below) + lower * below)
