"""The light of the flakes of one frame, in as few planes as it needs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Plane, as_plane, magnitude
from fire_atlas.effect.flakes.tracks import Table, by_column

FAINTEST = 4e-4
"""Light, linear, below which nothing is drawn: one step of sRGB's 255."""


@dataclass(frozen=True, slots=True)
class FlakeLight:
    """Light on black, linear, summed over all flakes; it may exceed 1 by far.

    The light of a pixel is Σ planes · colours: one plane where all flakes have one colour.

    Attributes:
        planes: (planes, H, W) float32.
        colours: (planes, 3) float32, linear R, G, B; the brightest channel is 1.
    """

    planes: NDArray[np.float32]
    colours: NDArray[np.float32]

    def rgb(self) -> NDArray[np.float32]:
        """Return the light of all pixels, (H, W, 3)."""
        _, height, width = self.planes.shape
        return self.at(np.arange(height * width)).T.reshape(height, width, 3)

    def at(self, pixels: NDArray[np.intp]) -> NDArray[np.float32]:
        """Return the light (3, n) of the pixels at flat indices (n,)."""
        planes = self.planes.reshape(len(self.planes), -1).take(pixels, axis=1)
        if len(planes) == 1:
            return as_plane(self.colours.T * planes)
        return as_plane(np.einsum("pc,pn->cn", self.colours, planes))

    def touched(self) -> NDArray[np.intp]:
        """Return the flat indices of all pixels that have visible light, ascending."""
        return np.flatnonzero(self.brightest() > FAINTEST)

    def brightest(self) -> Plane:
        """Return the light of the brightest channel of each pixel, (H, W)."""
        return as_plane(self.planes.max(axis=0) if len(self.planes) > 1 else self.planes[0])

    def dots(self, least: float) -> Plane:
        """Return how far flakes cover each pixel, (H, W), 0..1, if they are painted as flat dots.

        A dot ends where its light falls below ``least``, with an edge as smooth as a drawing's:
        coverage falls from 1 to 0 over the pixel that the outline goes through.
        """
        # Its logarithm falls evenly beyond the middle of a flake: the slope tells how far it is.
        level = np.log(np.maximum(self.brightest(), FAINTEST) / np.float32(least))
        down, across = np.gradient(level)
        distance = level / np.maximum(magnitude(as_plane(down), as_plane(across)), 1e-6)
        return as_plane(np.clip(0.5 + distance, 0, 1))


def in_few_planes(rows: Table) -> tuple[Table, NDArray[np.float32]]:
    """Return the light of flakes in each plane, (planes, flakes), and the planes' colours.

    One plane, if all flakes have the same colour.
    """
    column = by_column(rows)
    rgb = np.stack([column[name] for name in "rgb"])
    brightest = rgb.max(axis=0, initial=0)
    hues = rgb / np.maximum(brightest, 1e-12)
    if (np.abs(hues - hues[:, :1]) < 1e-6).all() and hues.size:
        return brightest[None] * column["a"], as_plane(hues[:, :1].T)
    return rgb * column["a"], np.eye(3, dtype=np.float32)


def ranges(
    first: NDArray[np.floating | np.integer], last: NDArray[np.floating | np.integer]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return, for every integer in the ranges first..last, the index of its range, and itself."""
    count = np.maximum(last - first + 1, 0).astype(np.intp)
    owner = np.repeat(np.arange(len(count)), count)
    before = first.astype(np.intp) - (np.cumsum(count) - count)
    return owner, before[owner] + np.arange(len(owner))
