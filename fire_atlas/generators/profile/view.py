"""A fire seen by one camera: heat mixed by particles, shades looked up, sway put back.

What is seen at a place is the heat of the frames shown there, mixed, and looked up among the
colours that place has in the clip.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import ndtr

from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.generators.profile.blaze import Blaze
from fire_atlas.generators.profile.face import HEAT_UNIT
from fire_atlas.generators.profile.particles import half_width
from fire_atlas.generators.profile.shading import Shading, outline, shading_of
from fire_atlas.generators.profile.territory import COARSE, Territory, territories


@dataclass(frozen=True, slots=True)
class Stance:
    """How the fire stands in a frame.

    Attributes:
        offset: (NODES,) of its middle from the axis, flame heights.
        ratio: (NODES,) of its width to the mean.
        lean: Degrees the wind bends it, to the right of the camera.
    """

    offset: NDArray[np.float64]
    ratio: NDArray[np.float64]
    lean: float


@dataclass(frozen=True, slots=True)
class View:
    """One camera's view of a blaze.

    Attributes:
        blaze: What is looked at.
        azimuth: Radians the camera went round it, counter-clockwise seen from above.
        half: Half the width of the fire's foot, flame heights.
        narrowing: Half the width of the flame by height, in half widths of its foot.
        shading: Colours by place and heat.
    """

    blaze: Blaze
    azimuth: float
    half: float
    narrowing: CubicSpline
    shading: Shading

    @classmethod
    def of(cls, blaze: Blaze, azimuth: float) -> "View":
        """Look at ``blaze`` from ``azimuth``, radians."""
        half = half_width(blaze.curve, azimuth) * blaze.profile.front.face.half
        shading = shading_of(blaze.profile, azimuth)
        return cls(blaze, azimuth, half, outline(blaze.profile), shading)

    def territories(self, frame: int) -> list[Territory]:
        """Return where each splice is seen in a frame."""
        time = float(self.blaze.times[frame])
        return territories(self.blaze, self.azimuth, self.half, self.narrowing, time)

    def picture(self, territories: list[Territory]) -> Pixels:
        """Return the fire on the grid, upright."""
        shape = self.blaze.profile.grid.shape
        mixed, power = np.zeros(shape, np.float32), np.full(shape, 1e-30, np.float32)
        for each in territories:
            weight = _enlarged(each.weight, shape)
            mixed += weight * self._heat(each)
            power += weight * weight
        return self.shading.colours(as_plane(ndtr(mixed / np.sqrt(power))))

    def _heat(self, of: Territory) -> Plane:
        face = self.blaze.profile.sides[of.side].face
        first, second, part = of.frames
        heat = (face.heat[first].astype(np.float32) - 128) / np.float32(HEAT_UNIT)
        if part > 0:
            later = (face.heat[second].astype(np.float32) - 128) / np.float32(HEAT_UNIT)
            # Where frames have much in common, mixing them takes less away.
            both = np.float32(2 * part * (1 - part)) * self.blaze.kinships[of.side]
            kept = np.sqrt(both + np.float32((1 - part) ** 2 + part**2))
            heat = (heat * np.float32(1 - part) + later * np.float32(part)) / kept
        return as_plane(heat[:, ::-1] if of.mirrored else heat)

    def stance(self, frame: int) -> Stance:
        """Return how the fire stands."""
        weather, time = self.blaze.weather, float(self.blaze.times[frame])
        (right, broad), (away, deep) = (swing.at(time) for swing in self.blaze.swings)
        cos, sin = math.cos(self.azimuth), math.sin(self.azimuth)
        sway = (right * cos + away * sin) * self.blaze.gain
        offset = sway * weather.swing(frame) + self._mean_offset()
        ratio = np.exp(broad * cos * cos + deep * sin * sin)
        lean = weather.lean(frame, self.azimuth) + self.blaze.bias * cos
        return Stance(offset, ratio, lean)

    def _mean_offset(self) -> NDArray[np.float64]:
        """(NODES,) where the middle of the fire is on average."""
        sides = self.blaze.profile.sides
        front, side = (each.face.pose.offset.mean(axis=0) for each in (sides[0], sides[-1]))
        cos, sin = math.cos(self.azimuth), math.sin(self.azimuth)
        return np.asarray(front * cos * abs(cos) + side * sin * abs(sin))

    def drift(self, territories: list[Territory]) -> NDArray[np.float32]:
        """(r, c, 2) how what is seen moves across the grid, cells a second, x and y down."""
        rows, columns = self.blaze.profile.front.face.drift.shape[1:3]
        mixed = np.zeros((rows, columns, 2), np.float32)
        power = np.full((rows, columns, 1), 1e-30, np.float32)
        for each in territories:
            weight = cv2.resize(each.weight, (columns, rows), interpolation=cv2.INTER_LINEAR)
            face, reel = self.blaze.profile.sides[each.side].face, self.blaze.reels[each.side]
            moves = face.drift[each.frames[0]] * np.float32(
                reel.rate * self.blaze.asked.fps / self.blaze.profile.sides[each.side].fps
            )
            if each.mirrored:
                moves = moves[:, ::-1] * np.array([-1, 1], np.float32)
            mixed += weight[..., None] * moves
            power += weight[..., None]
        return as_plane(mixed / power)


def _enlarged(weight: Plane, shape: tuple[int, int]) -> Plane:
    """Coarse weights at every cell of a grid of ``shape``."""
    rows, columns = weight.shape
    full = cv2.resize(weight, (columns * COARSE, rows * COARSE), interpolation=cv2.INTER_LINEAR)
    return as_plane(full[: shape[0], : shape[1]])
