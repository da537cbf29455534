"""The light a fire gives in each frame: sum, colour and centre, for an engine's light source."""

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import REC709


@dataclass(frozen=True, slots=True)
class FrameLight:
    """Sums over the pixels of a frame, in linear light on black; those of several frames add up.

    Attributes:
        rgb: (3,) float64, sum of each channel.
        x, y: Σ luminance · x and Σ luminance · y, px from the frame's top-left corner.
        square: Σ luminance · (x² + y²), px².
    """

    rgb: NDArray[np.float64]
    x: float
    y: float
    square: float

    @classmethod
    def of(cls, layer: NDArray[np.float32]) -> Self:
        """Measure a layer (H, W, 3 or 4) of light; a fourth channel, coverage, is ignored."""
        columns = cv2.reduce(layer, 0, cv2.REDUCE_SUM, dtype=cv2.CV_64F)[0, :, :3]
        rows = cv2.reduce(layer, 1, cv2.REDUCE_SUM, dtype=cv2.CV_64F)[:, 0, :3]
        across, down = (columns * REC709).sum(axis=1), (rows * REC709).sum(axis=1)
        x, y = np.arange(len(across)) + 0.5, np.arange(len(down)) + 0.5
        return cls(
            rgb=columns.sum(axis=0),
            x=float((across * x).sum()),
            y=float((down * y).sum()),
            square=float((across * x**2).sum() + (down * y**2).sum()),
        )

    def __add__(self, other: "FrameLight") -> "FrameLight":
        """Return the light of both frames."""
        return FrameLight(
            self.rgb + other.rgb, self.x + other.x, self.y + other.y, self.square + other.square
        )


@dataclass(frozen=True, slots=True)
class ClipLight:
    """The light of an animation.

    Attributes:
        fps: Frames per second.
        width, height: Frame size, px.
        loop: Whether frame 0 follows the last frame.
        frames: The light of each frame.
    """

    fps: float
    width: int
    height: int
    loop: bool
    frames: tuple[FrameLight, ...]
