"""A flame as it burns with less fuel: lower and thinner, eaten away from its tips and edges, cooler,
in its own colours. It is never a fade: what is hot burns longest."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Pixels, Plane, as_plane, encode_unit

_STEPS = 64
"""Number of brightnesses for which a flame's colours are known."""

_VISIBLE = 1 / 255
"""Brightness up to which a pixel shows no flame."""

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

_EMBERS = 0.15
"""Fuel from which on down the rest cools to nothing."""


@dataclass(frozen=True, slots=True)
class FlameFuel:
    """How a flame looks with less fuel than in its clip.

    Attributes:
        foot: (x, y) of the place that stays where it is, px.
        rises: Unit vector, image axes, in which it rises.
        length: Its height, px along that direction.
        narrows: How much narrower it gets when it gets lower, 0..1: of a wide one little.
        colours: (steps, 4) its light and coverage at brightnesses from 0 to 1: increasing.
        is_drawn: Whether it is drawn in flat colours, which it keeps: it only gets smaller.
    """

    foot: tuple[float, float]
    rises: tuple[float, float]
    length: float
    narrows: float
    colours: NDArray[np.float32]
    is_drawn: bool

    @classmethod
    def of(
        cls,
        frames: Sequence[Pixels],
        foot: tuple[float, float],
        rises: tuple[float, float],
        size: tuple[float, float],
        *,
        is_drawn: bool,
    ) -> Self:
        """Measure a flame.

        Args:
            frames: (H, W, 4) the flame alone, in a few frames.
            foot, rises: As the attributes.
            size: Its length along ``rises``, and its width, px.
            is_drawn: Whether it is drawn in flat colours.
        """
        seen = np.concatenate([frame.reshape(-1, 4) for frame in frames])
        heat = _heat(seen)
        seen, heat = seen[heat > _VISIBLE], heat[heat > _VISIBLE]
        step = np.minimum((heat * _STEPS).astype(np.intp), _STEPS - 1)
        count = np.bincount(step, minlength=_STEPS)
        sums = [np.bincount(step, seen[:, k], _STEPS) for k in range(4)]
        known = np.flatnonzero(count)
        at = np.arange(_STEPS + 1) / _STEPS
        places = np.concatenate([[0.0], (known + 0.5) / _STEPS])
        table = [
            np.interp(at, places, np.concatenate([[0.0], channel[known] / count[known]]))
            for channel in sums
        ]
        colours = np.maximum.accumulate(np.stack(table, axis=1))
        length, width = size
        narrows = float(np.clip(length / max(width, 1.0) - 0.5, 0, 1))
        return cls(foot, rises, length, narrows, as_plane(colours), is_drawn)

    def burnt(self, flame: Pixels, fuel: float) -> Pixels:
        """Return a flame (H, W, 4) with ``fuel`` 0..1: 1 is as it is, with 0 nothing is left."""
        if fuel >= 1:
            return flame
        if fuel <= 0:
            return np.zeros_like(flame)
        lowest = 0.0 if self.is_drawn else _LOWEST
        lower = lowest + (1 - lowest) * fuel**_HEIGHT_POWER
        moved = self._lowered(flame, lower)
        if self.is_drawn:
            return moved
        heat = _heat(moved)
        left = self._left(heat, fuel, lower)
        share = self._colour(left) / np.maximum(self._colour(heat), np.float32(1e-6))
        return as_plane(moved * np.minimum(share, 1))

    def _lowered(self, flame: Pixels, lower: float) -> Pixels:
        """Return a flame whose height is ``lower`` times what it was."""
        along = np.array(self.rises)
        narrower = lower ** (0.5 * self.narrows)
        turn = narrower * np.eye(2) + (lower - narrower) * np.outer(along, along)
        foot = np.array(self.foot) - 0.5  # OpenCV counts from the middle of the first pixel
        matrix = np.column_stack([turn, foot - turn @ foot])
        height, width = flame.shape[:2]
        # Averaged first, since OpenCV samples points, and what is made smaller would flicker.
        smooth = cv2.GaussianBlur(flame, (0, 0), max(0.01, 0.35 * (1 / lower - 1)))
        return as_plane(cv2.warpAffine(smooth, matrix, (width, height), flags=cv2.INTER_LINEAR))

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

    def _colour(self, heat: Plane) -> NDArray[np.float32]:
        """Return the flame's light and coverage (H, W, 4) at a ``heat`` (H, W)."""
        place = np.clip(heat, 0, 1) * np.float32(_STEPS)
        first = np.minimum(place.astype(np.intp), _STEPS - 1)
        part = (place - first)[..., None]
        return as_plane(self.colours[first] * (1 - part) + self.colours[first + 1] * part)


def _heat(flame: Pixels) -> Plane:
    """Return how bright a flame is shown over black, 0..1."""
    return encode_unit(flame[..., :3].max(axis=-1))
