"""A flame as it burns with less fuel: lower and thinner, eaten away from its tips and edges, cooler
in its own colours. It is never a fade: what is hot burns longest."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Pixels, Plane, as_plane, encode_unit
from fire_atlas.vision.pixel_grid import PixelGrid

_STEPS = 64
"""Number of brightnesses for which a flame's colours are known."""

_VISIBLE = 1 / 255
"""Brightness up to which a pixel shows no flame."""

_MIN_LIGHT = np.float32(1e-6)
"""Minimum light that light is divided by."""

_LOWEST = 0.12
"""Height of a flame almost without fuel, of its full one."""

_HEIGHT_POWER = 0.75
"""Its height grows with this power of its fuel: less than in proportion, as flames do."""

_BODY = 0.025
"""Size of what burns as one body, heights of the flame: thin wisps go out before it."""

_TIPS = 0.8
"""How much sooner the tip of a flame goes out than its foot, of all its fuel."""

_COOL = 0.12
"""How far what still burns has cooled when the fuel is spent, of its heat."""

_COOLING = np.float32(1.6)
"""Power of what is left of its red with which the green of what glows falls at least, and of its
green its blue: about as of a black body around 2000 K."""

_EMBERS = 0.15
"""Fuel from which on down the rest cools to nothing."""


@dataclass(frozen=True, slots=True)
class CoolingColours:
    """The colours of a flame at every brightness, and how it loses them.

    Attributes:
        usual: (steps + 1, 4) light and coverage at brightnesses from 0 to 1, increasing.
        channels: Red, green and blue by the light that the flame gives in each, falling.
    """

    usual: NDArray[np.float32]
    channels: tuple[int, ...]

    @classmethod
    def of(cls, frames: Sequence[Pixels]) -> Self:
        """Measure a flame (H, W, 4) in a few frames."""
        seen = np.concatenate([frame.reshape(-1, 4) for frame in frames])
        heat = _heat(seen)
        seen, heat = seen[heat > _VISIBLE], heat[heat > _VISIBLE]
        step = np.minimum((heat * _STEPS).astype(np.intp), _STEPS - 1)
        known = np.unique(step)
        median = [np.zeros(4), *(np.median(seen[step == k], axis=0) for k in known)]
        places = np.concatenate([[0.0], (known + 0.5) / _STEPS])
        at = np.arange(_STEPS + 1) / _STEPS
        usual = np.stack(
            [np.interp(at, places, channel) for channel in np.transpose(median)], axis=1
        )
        total = seen[:, :3].sum(axis=0, dtype=np.float64)
        channels = np.argsort(-total, kind="stable").tolist()
        return cls(as_plane(np.maximum.accumulate(usual, axis=0)), tuple(channels))

    def cooled(self, heat: Plane, left: Plane) -> NDArray[np.float32]:
        """Return what is left, (H, W, 4) in 0..1, of the light and coverage of what cools from a
        ``heat`` (H, W) to that which is ``left``, (H, W).

        The weakest colour goes first, as of all that glows: of a white core the clip may show
        nothing cooler.
        """
        share = self._at(left) / np.maximum(self._at(heat), _MIN_LIGHT)
        share = np.minimum(share, 1)
        for stronger, weaker in pairwise(self.channels):
            most = share[..., stronger] ** _COOLING
            share[..., weaker] = np.minimum(share[..., weaker], most)
        return as_plane(share)

    def _at(self, heat: Plane) -> NDArray[np.float32]:
        """Return the usual light and coverage (H, W, 4) at a ``heat`` (H, W)."""
        place = np.clip(heat, 0, 1) * np.float32(_STEPS)
        first = np.minimum(place.astype(np.intp), _STEPS - 1)
        part = (place - first)[..., None]
        return as_plane(self.usual[first] * (1 - part) + self.usual[first + 1] * part)


@dataclass(frozen=True, slots=True)
class FlameFuel:
    """How a flame looks with less fuel than in its clip.

    Attributes:
        foot: (x, y) of the place that stays where it is, px.
        rises: Unit vector, image axes, in which it rises.
        length: Its height, px along that direction.
        narrows: How much narrower it gets when it gets lower, 0..1: of a wide one little.
        colours: How it cools; None if it is drawn in flat colours, which it keeps: it only gets
            smaller.
        art: The pixels of pixel art; None if it is none.
    """

    foot: tuple[float, float]
    rises: tuple[float, float]
    length: float
    narrows: float
    colours: CoolingColours | None
    art: PixelGrid | None

    @classmethod
    def of(
        cls,
        frames: Sequence[Pixels],
        foot: tuple[float, float],
        rises: tuple[float, float],
        size: tuple[float, float],
        *,
        is_drawn: bool = False,
        art: PixelGrid | None = None,
    ) -> Self:
        """Measure a flame.

        Args:
            frames: (H, W, 4) the flame alone, in a few frames.
            foot, rises, art: As the attributes.
            size: Its length along ``rises``, and its width, px.
            is_drawn: Whether it is drawn in flat colours.
        """
        length, width = size
        narrows = float(np.clip(length / max(width, 1.0) - 0.5, 0, 1))
        colours = None if is_drawn or art is not None else CoolingColours.of(frames)
        return cls(foot, rises, length, narrows, colours, art)

    def burnt(self, flame: Pixels, fuel: float) -> Pixels:
        """Return a flame (H, W, 4) with ``fuel`` 0..1: 1 is as it is, with 0 nothing is left."""
        if fuel >= 1:
            return flame
        if fuel <= 0:
            return np.zeros_like(flame)
        lowest = 0.0 if self.colours is None else _LOWEST
        lower = lowest + (1 - lowest) * fuel**_HEIGHT_POWER
        turn = self._lowering(lower)
        if self.art is not None:
            return _moved_art(flame, turn, self.foot, self.art)
        moved = _moved(flame, turn, self.foot, lower)
        if self.colours is None:
            return moved
        heat = _heat(moved)
        return as_plane(moved * self.colours.cooled(heat, self._left(heat, fuel, lower)))

    def _lowering(self, lower: float) -> NDArray[np.float64]:
        """Return the matrix (2, 2) that makes the flame ``lower`` times as high."""
        along = np.array(self.rises)
        narrower = lower ** (0.5 * self.narrows)
        return np.asarray(narrower * np.eye(2) + (lower - narrower) * np.outer(along, along))

    def _left(self, heat: Plane, fuel: float, lower: float) -> Plane:
        """Return the heat (H, W) that is left of a flame ``lower`` times as high."""
        height, width = heat.shape
        y, x = np.mgrid[:height, :width].astype(np.float32)
        x, y = x + np.float32(0.5 - self.foot[0]), y + np.float32(0.5 - self.foot[1])
        up = (x * np.float32(self.rises[0]) + y * np.float32(self.rises[1])) / np.float32(
            max(self.length * lower, 1.0)
        )
        body = cv2.GaussianBlur(heat, (0, 0), max(0.5, _BODY * self.length))
        spent = np.float32(1 - fuel)
        lost = spent * (np.float32(1.15) - body) * (1 + np.float32(_TIPS) * (np.clip(up, 0, 1) - 1))
        kept = np.clip(heat - lost, 0, None) / np.maximum(1 - lost, np.float32(1e-3))
        cool = (1 - _COOL * (1 - fuel)) * float(smooth_step(np.array(min(fuel / _EMBERS, 1.0))))
        return as_plane(np.minimum(kept, heat) * np.float32(cool))


def _moved(
    flame: Pixels, turn: NDArray[np.float64], foot: tuple[float, float], lower: float
) -> Pixels:
    """Return a flame (H, W, 4), which gets ``lower``, turned by a matrix around its foot."""
    fixed = np.array(foot) - 0.5  # OpenCV counts from the middle of the first pixel
    matrix = np.column_stack([turn, fixed - turn @ fixed])
    height, width = flame.shape[:2]
    # Averaged first, since OpenCV samples points, and what is made smaller would flicker.
    smooth = cv2.GaussianBlur(flame, (0, 0), max(0.01, 0.35 * (1 / lower - 1)))
    return as_plane(cv2.warpAffine(smooth, matrix, (width, height), flags=cv2.INTER_LINEAR))


def _moved_art(
    flame: Pixels, turn: NDArray[np.float64], foot: tuple[float, float], art: PixelGrid
) -> Pixels:
    """Return a flame of pixel art turned around its foot: whole pixels of it, in its colours."""
    height, width = flame.shape[:2]
    y, x = (
        (np.arange(length) - first) // art.side
        for length, first in ((height, art.y), (width, art.x))
    )
    middles = np.stack(np.meshgrid(x, y), axis=-1) + 0.5
    fixed = (np.array(foot) - (art.x, art.y)) / art.side
    cells = np.floor((middles - fixed) @ np.linalg.inv(turn).T + fixed).astype(np.intp)
    column, row = (
        cells[..., k] * art.side + first + art.side // 2 for k, first in enumerate((art.x, art.y))
    )
    is_inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    found = flame[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    return as_plane(found * is_inside[..., None])


def _heat(flame: Pixels) -> Plane:
    """Return how hot a flame is, 0..1: the mean of R, G and B as they are shown over black."""
    return as_plane(encode_unit(flame[..., :3]).mean(axis=-1))
