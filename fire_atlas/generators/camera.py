"""The orthographic camera that every generator renders its fire with."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Camera:
    """An orthographic camera that looks at a fire standing on the ground.

    World axes: x to the right of the front view, y away from it, z up. The unit of length is the
    generator's own.

    Attributes:
        azimuth: Direction it looks from, rad, counter-clockwise seen from above; 0: the front.
        elevation: Angle of the camera above the horizon, rad.
        width, height: Size of the frame, px.
        origin: (x, y) px at which the world's origin appears.
        scale: Pixels per unit of length.
    """

    azimuth: float
    elevation: float
    width: int
    height: int
    origin: tuple[float, float]
    scale: float

    def axes(self) -> NDArray[np.float64]:
        """Camera axes right, down and away from it: (3, 3) unit vectors in world coordinates."""
        right = np.array([math.cos(self.azimuth), math.sin(self.azimuth), 0.0])
        level = np.array([-math.sin(self.azimuth), math.cos(self.azimuth), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        away = level * math.cos(self.elevation) - up * math.sin(self.elevation)
        down = -(up * math.cos(self.elevation) + level * math.sin(self.elevation))
        return np.stack([right, down, away])

    def project(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Project world positions (..., 3) to (..., 3): px right, px down, depth in world units."""
        seen = self.project_vectors(points)
        seen[..., :2] += self.origin
        return seen

    def project_vectors(self, vectors: NDArray[np.floating]) -> NDArray[np.float64]:
        """Project world vectors such as velocities: as ``project``, but the origin is not added."""
        seen = np.asarray(np.einsum("...d,ad->...a", np.asarray(vectors, np.float64), self.axes()))
        seen[..., :2] *= self.scale
        return seen
