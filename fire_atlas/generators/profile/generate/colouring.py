"""Colours by place in the flame: the region detector of Lee et al., III-C, Figure 10.

A place's colour is that of the cell of the colour table in which it lies, bilinear between cells.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Pixels, brightness, decode_bytes, luminance
from fire_atlas.generators.profile.flame_region import largest_flame
from fire_atlas.generators.profile.model import ColourTable, Profile
from fire_atlas.vision.warp import sample_at

_TABLE_SHARE = 0.3
"""Share of the table's own hue in the colours of the clip's detail. The rest is the clip's hue at
the place, which a table of a few cells does not hold."""

_LEAST = 1e-3
"""Smallest linear colour or coverage that is divided by."""

_MIN_COVERAGE = 0.03
"""Coverage above which a cell has a colour of its own."""

_Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class ColourField:
    """The colours of a table as a field over the box of a flame.

    Attributes:
        colours: (n, n, 3) float32: linear colours at the middles of the cells, between which the
            field is bilinear.
    """

    colours: _Array

    @classmethod
    def of(cls, table: ColourTable, weight: _Array) -> "ColourField":
        """Return the field whose mean over each cell is the cell's colour.

        ``weight`` is the (n, n) coverage as learnt. Cells that the flame hardly ever reaches take
        the colours of cells nearby, or they would darken its edge.
        """
        size = len(table.colours)
        colours = decode_bytes(table.colours).reshape(size * size, 3)
        place = np.stack(np.divmod(np.arange(size * size), size), axis=1)
        apart = np.square(place[:, None] - place[None]).sum(axis=2) / (size / 5) ** 2
        near = np.exp(-apart / 2) * (weight.ravel() + _LEAST)
        filled = near @ colours / near.sum(axis=1, keepdims=True)
        needed = np.where(weight.reshape(-1, 1) > _MIN_COVERAGE, colours, filled)
        # The mean of a bilinear field over a cell mixes in its neighbours. That is undone.
        mixing = np.linalg.inv(_mixing(size))
        means = needed.reshape(size, size, 3)
        cells = np.einsum("ij,jkc,lk->ilc", mixing, means, mixing)
        return cls(np.clip(cells, means / 3, np.minimum(2 * means, 1)).astype(np.float32))

    def at(self, across: NDArray[np.floating], down: NDArray[np.floating]) -> _Array:
        """Return linear colours (..., 3) at places in the box, from (0, 0), its top-left corner, to
        (1, 1)."""
        return sample_table(self.colours, across, down)


def _mixing(size: int) -> NDArray[np.float64]:
    """Return how much of each of ``size`` cells is in the mean of the bilinear field over each."""
    mixing = np.eye(size) * 0.75 + (np.eye(size, k=1) + np.eye(size, k=-1)) * 0.125
    mixing[0, 0] = mixing[-1, -1] = 0.875
    return mixing


def sample_table(table: _Array, across: NDArray[np.floating], down: NDArray[np.floating]) -> _Array:
    """Return the values (rows, columns, ...) of a table (n, n, ...) at places in a box, bilinear
    between the middles of the cells."""
    size, last = len(table), len(table) - 1
    x, y = (np.clip(place * size - 0.5, 0, last) for place in (across, down))
    return sample_at(table, x, y)


@dataclass(frozen=True, slots=True)
class TableColours:
    """The colour tables of a profile, as learnt and as edited.

    Attributes:
        current, learnt: Their fields.
        coverage: (n, n) float32, 0..1: coverage as learnt.
        coverage_gain: (n, n) float32: coverage as edited over that learnt.
        is_edited: Whether they differ.
        threshold: Brightness above which a pixel is flame, 0..255.
    """

    current: ColourField
    learnt: ColourField
    coverage: _Array
    coverage_gain: _Array
    is_edited: bool
    threshold: float

    @classmethod
    def of(cls, profile: Profile, azimuth: float = 0.0) -> "TableColours":
        """Read the tables of a profile, as a camera at ``azimuth``, radians, sees them.

        Those of the front and the side are mixed as their shades are; from behind they are
        mirrored.
        """
        cos, sin = math.cos(azimuth), math.sin(azimuth)
        shares, fields = list[float](), list[tuple[_Array, ...]]()
        for side, part in ((profile.sides[0], cos), (profile.sides[-1], sin)):
            weight = side.learnt_colours.coverage
            ratio = side.colours.coverage / np.maximum(weight, _LEAST)
            gain = np.where(side.colours.coverage == weight, 1, ratio).astype(np.float32)
            learnt = current = ColourField.of(side.learnt_colours, weight).colours
            if side.colours is not side.learnt_colours:
                current = ColourField.of(side.colours, weight).colours
            turned = -1 if part < 0 else 1
            seen = (table[:, ::turned].copy() for table in (current, learnt, weight, gain))
            shares.append(part * part)
            fields.append(tuple(seen))
        current, learnt, coverage, gain = (
            _mixed(shares, tables) for tables in zip(*fields, strict=True)
        )
        thresholds = profile.sides[0].threshold, profile.sides[-1].threshold
        threshold = sum(share * limit for share, limit in zip(shares, thresholds, strict=True))
        is_edited = any(side.colours is not side.learnt_colours for side in profile.sides)
        as_learnt = ColourField(learnt)
        return cls(
            ColourField(current) if is_edited else as_learnt, as_learnt, coverage, gain,
            is_edited, threshold,
        )  # fmt: skip

    def apply(self, pixels: Pixels) -> None:
        """Give a drawn flame (H, W, 4), within 0..1, the colours of the table, in place.

        Its hue is partly that of the table, and all of it goes with the edits of the table.
        """
        left, top, width, height = cv2.boundingRect((pixels[..., 3] > 0).view(np.uint8))
        part = pixels[top : top + height, left : left + width]
        flame = largest_flame((brightness(part, "srgb") > self.threshold).astype(np.uint8))
        if flame.any():
            self._apply(part, flame)

    def _apply(self, pixels: Pixels, flame: NDArray[np.bool_]) -> None:
        across, down = (places.astype(np.float32) for places in _box_places(flame))
        x, y = np.meshgrid(across, down)
        current = self.current.at(x, y)
        learnt = current if self.learnt is self.current else self.learnt.at(x, y)
        light = luminance(pixels) / np.maximum(luminance(learnt), _LEAST)
        *channels, coverage = cv2.split(pixels)
        gain = sample_table(self.coverage_gain, x, y) if self.is_edited else None
        if gain is not None:
            coverage = np.clip(coverage * gain, 0, 1)
        share, coloured = np.float32(_TABLE_SHARE), []
        for own, now, before in zip(channels, cv2.split(current), cv2.split(learnt), strict=True):
            colour = own * (now / np.maximum(before, np.float32(_LEAST))) * (1 - share)
            colour += now * light * share
            if gain is not None:
                colour *= gain
            coloured.append(np.clip(colour, 0, coverage, out=colour))
        cv2.merge((*coloured, coverage), dst=pixels)


def _mixed(shares: Sequence[float], tables: Sequence[_Array]) -> _Array:
    """Return the tables (n, n, ...) of the two sides, mixed; one of them where it alone is seen."""
    if tables[0].shape != tables[1].shape or min(shares) < 1e-9:
        return tables[int(shares[1] > shares[0])]
    return np.asarray(tables[0] * shares[0] + tables[1] * shares[1], np.float32)


def _box_places(flame: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the place of each column, and of each row, in the box of a flame: 0..1 inside it."""
    places = []
    for axis in (0, 1):
        found = np.flatnonzero(flame.any(axis=axis))
        length = found[-1] + 1 - found[0]
        places.append((np.arange(flame.shape[1 - axis]) + 0.5 - found[0]) / length)
    return places[0], places[1]
