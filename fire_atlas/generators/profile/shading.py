"""The region detector: which colour heat has at a place (Lee et al., III-C)."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fire_atlas.core.pixels import Bytes, Pixels, Plane, as_plane, decode_bytes
from fire_atlas.generators.profile.face import Face, light_of
from fire_atlas.generators.profile.grid import Grid
from fire_atlas.generators.profile.model import Profile


@dataclass(frozen=True, slots=True)
class Shading:
    """Colours by place.

    Attributes:
        levels: Number of shades.
        table: (levels · rows · columns, 4) float32: pixels from the dimmest to the brightest.
    """

    levels: int
    table: NDArray[np.float32]

    def colours(self, rank: Plane) -> Pixels:
        """Return the pixels of a picture (rows, columns) of ranks, 0 dimmest to 1 brightest."""
        place = rank.ravel() * np.float32(self.levels - 1)
        lower = np.minimum(place.astype(np.int32), self.levels - 2)
        part = (place - lower)[:, None]
        start = lower * rank.size + np.arange(rank.size, dtype=np.int32)
        dim = np.take(self.table, start, axis=0)
        bright = np.take(self.table, start + rank.size, axis=0)
        dim += (bright - dim) * part
        return dim.reshape(*rank.shape, 4)


def shading_of(profile: Profile, azimuth: float) -> Shading:
    """Return the shades that a camera at ``azimuth`` (radians) sees.

    Between two sides they pass into one another; from behind they are mirrored.
    """
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    sides = profile.sides
    seen: NDArray[np.float32] | None = None
    for side, turn in ((sides[0], cos), (sides[-1], sin)):
        share = np.float32(turn * turn)
        if share < 1e-9:
            continue
        shades = light_of(side.face.shades)
        part = (shades if turn > 0 else shades[:, :, ::-1]) * share
        seen = part if seen is None else seen + part
    assert seen is not None, "cos² + sin² = 1"
    gain = _recoloured(profile)
    if gain is not None:
        seen = seen * gain
        seen[..., :3] = np.minimum(seen[..., :3], seen[..., 3:])
    return Shading(len(seen), np.ascontiguousarray(seen.reshape(-1, 4)))


def _recoloured(profile: Profile) -> NDArray[np.float32] | None:
    """(rows, columns, 4) by what to multiply the shades, where the colour table was changed.

    Smooth between the middles of the table's cells, so that no grid shows.
    """
    now, then = profile.colours, profile.learnt
    if (now.colours == then.colours).all() and (now.coverage == then.coverage).all():
        return None
    ratio = _light(now.colours) / np.maximum(_light(then.colours), 1e-3)
    covers = now.coverage / np.maximum(then.coverage, 1e-3)
    gains = np.dstack([ratio * covers[..., None], covers]).astype(np.float32)
    grid, size = profile.grid, len(now.colours)
    rows = (1.0 - grid.heights) * size - 0.5
    columns = (grid.across + 1.0) / 2 * size - 0.5
    at_x, at_y = np.meshgrid(columns.astype(np.float32), rows.astype(np.float32))
    last = np.float32(size - 1)
    return as_plane(
        cv2.remap(
            gains, np.clip(at_x, 0, last), np.clip(at_y, 0, last), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
    )  # fmt: skip


def _light(colours: Bytes) -> NDArray[np.float32]:
    return decode_bytes(colours)


def outline(profile: Profile) -> CubicSpline:
    """Half the width of the flame by height, in half widths of its foot: one cubic, base to top."""
    grid, face = profile.grid, profile.front.face
    heights = np.array([0.0, 0.35, 0.7, 1.05])
    return CubicSpline(heights, [_reach(face, grid, height) for height in heights])


def _reach(face: Face, grid: Grid, height: float) -> float:
    """Half the width, in half widths of the foot, where the flame often is at ``height``."""
    row = int(np.clip(grid.up - height * grid.per_height - 1, 0, grid.shape[0] - 1))
    often = face.shades[3 * len(face.shades) // 4, row, :, 3] > 48
    if not often.any():
        return 0.3
    return max(0.3, float(np.abs(grid.across[often]).max()))
