"""An orthographic eye that looks at the fire from any side."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Camera:
    """Where the eye is, and the frame it sees.

    Attributes:
        azimuth: How far the eye has gone round the fire, degrees, counter-clockwise from above.
        elevation: How far above the horizon it is, degrees.
        width, height: Of the frame, px.
        foot: Height of the ground's middle above the frame's lower edge, heights.
    """

    azimuth: float
    elevation: float
    width: int
    height: int
    foot: float

    def axes(self) -> NDArray[np.float64]:
        """Unit vectors (3, 3) of what is to the right, down and away from the eye, in the scene."""
        turn, tilt = math.radians(self.azimuth), math.radians(self.elevation)
        right = np.array([math.cos(turn), math.sin(turn), 0.0])
        level = np.array([-math.sin(turn), math.cos(turn), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        away = level * math.cos(tilt) - up * math.sin(tilt)
        return np.stack([right, -(up * math.cos(tilt) + level * math.sin(tilt)), away])

    def project(self, x: NDArray[np.floating]) -> NDArray[np.float64]:
        """Places (..., 3) in heights → (..., 3): px to the right and down, and heights away."""
        seen = np.einsum("...d,ad->...a", np.asarray(x, np.float64), self.axes())
        seen[..., :2] *= self.height
        seen[..., 0] += self.width / 2
        seen[..., 1] += self.height * (1 - self.foot)
        return np.asarray(seen)

    def turned(self, v: NDArray[np.floating]) -> NDArray[np.float64]:
        """Vectors (..., 3) in heights → (..., 3) px right and down, and heights away."""
        seen = np.einsum("...d,ad->...a", np.asarray(v, np.float64), self.axes())
        seen[..., :2] *= self.height
        return np.asarray(seen)
