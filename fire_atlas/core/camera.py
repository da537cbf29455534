"""The camera that sees a fire with depth: its frames and its flakes."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

_NEAREST = 0.05
"""Least distance of a point in front of the camera that is projected, of the camera's distance."""


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera that looks at a fire standing on the ground.

    World axes: x to the right of the front view, y away from it, z up. The unit of length is the
    generator's own.

    Attributes:
        azimuth: Direction it looks from, rad, counter-clockwise seen from above; 0: the front.
        elevation: Angle of the camera above the horizon, rad.
        width, height: Size of the frame, px.
        origin: (x, y) px at which the world's origin appears.
        scale: Pixels per unit of length; in perspective, at the depth of the world's origin.
        distance: Distance from there to the camera, which faces the middle of the frame; infinite
            if lines of sight are parallel.
        tiles: Whether the frame is a tile, to be laid side by side with itself: what leaves it at
            one side enters at the other.
    """

    azimuth: float
    elevation: float
    width: int
    height: int
    origin: tuple[float, float]
    scale: float
    distance: float = math.inf
    tiles: bool = False

    def from_the_front(self) -> Self:
        """Return the camera in front of the fire, level, whose lines of sight are parallel."""
        return replace(self, azimuth=0.0, elevation=0.0, distance=math.inf)

    def from_the_right(self) -> Self:
        """Return the same camera at the fire's right. A tile's ends are seen from there."""
        return replace(self, azimuth=self.azimuth + math.pi / 2, tiles=False)

    def axes(self) -> NDArray[np.float64]:
        """Camera axes right, down and away from it: (3, 3) unit vectors in world coordinates."""
        right = np.array([math.cos(self.azimuth), math.sin(self.azimuth), 0.0])
        level = np.array([-math.sin(self.azimuth), math.cos(self.azimuth), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        away = level * math.cos(self.elevation) - up * math.sin(self.elevation)
        down = -(up * math.cos(self.elevation) + level * math.sin(self.elevation))
        return np.stack([right, down, away])

    def project(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Project world positions (..., 3) to (..., 3): px right, px down, depth in world units.

        Depth is measured along the view, from the plane of the world's origin.
        """
        seen = self._parallel(points)
        size = self.magnification(seen[..., 2])[..., None]
        seen[..., :2] = self._middle + (seen[..., :2] + self.origin - self._middle) * size
        return seen

    def unproject(self, seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the world positions (..., 3) of what ``project`` places at ``seen`` (..., 3)."""
        start, change = self.rays(seen[..., 0], seen[..., 1])
        return np.asarray((start + seen[..., 2:] * change) @ self.axes())

    def project_velocities(
        self, points: NDArray[np.floating], velocities: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Project velocities (..., 3) of world positions: (..., 2) px right and down per time."""
        moved = self._parallel(velocities)
        if math.isinf(self.distance):
            return moved[..., :2]
        seen = self.project(points)
        size = self.magnification(seen[..., 2])[..., None]
        # What comes nearer moves outwards, away from the middle of the frame.
        outwards = (seen[..., :2] - self._middle) * (size / self.distance)
        return np.asarray(moved[..., :2] * size - outwards * moved[..., 2:])

    def magnification(self, depth: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return how much larger things at ``depth`` appear than those at the world's origin."""
        if math.isinf(self.distance):
            return np.ones_like(depth, np.float64)
        nearness = np.maximum(1 + np.asarray(depth, np.float64) / self.distance, _NEAREST)
        return np.asarray(1 / nearness)

    def sight_lines(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return unit vectors (..., 3) from the camera to world positions (..., 3)."""
        right, down, away = self.axes()
        if math.isinf(self.distance):
            return np.broadcast_to(away, points.shape)
        x, y = (self._middle - self.origin) / self.scale
        lines = np.asarray(points - (right * x + down * y - away * self.distance), np.float64)
        return np.asarray(lines / np.sqrt((lines * lines).sum(axis=-1, keepdims=True)))

    def view_of(self, vectors: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return world vectors (..., 3) in camera axes, in world units."""
        return np.asarray(np.einsum("...d,ad->...a", np.asarray(vectors, np.float64), self.axes()))

    def rays(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what is seen at places x, y (px) of the frame, in camera axes and world units: its
        position at depth 0, and how that changes per unit of depth, both (..., 3)."""
        seen = np.stack([x, y], axis=-1)
        start = np.zeros((*seen.shape[:-1], 3))
        start[..., :2] = (seen - self.origin) / self.scale
        change = np.ones_like(start)
        change[..., :2] = (seen - self._middle) / (self.scale * self.distance)
        return start, change

    @property
    def _middle(self) -> NDArray[np.float64]:
        """Middle of the frame, px: where lines of sight are parallel to the view."""
        return np.array([self.width / 2, self.height / 2])

    def _parallel(self, vectors: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return world vectors (..., 3) in camera axes: px right, px down, depth in world units."""
        seen = self.view_of(vectors)
        seen[..., :2] *= self.scale
        return seen
