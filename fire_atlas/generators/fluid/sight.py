"""The gas of a frame as a camera sees it: layers away from it, rows and columns of its frame."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fire_atlas.core.camera import Camera
from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.pixels import as_plane
from fire_atlas.generators.fluid.advection import look_up, places
from fire_atlas.generators.fluid.grid import Field
from fire_atlas.generators.fluid.noise import curl_noise
from fire_atlas.generators.fluid.scene import Scene

_TILE = 48
"""Side of the noise that displaces gas, cubes."""

_WAVES = (2.5, 8.0)
"""Its shortest and longest wavelength, cubes."""

_FARTHEST = 1.5
"""Displacement, cubes, of ``detail: 1`` (rms); more is wavy."""

_RISE = 0.9
"""Speed at which that noise rises, heights/s."""


@dataclass(frozen=True)
class Sight:
    """What a camera sees of a scene.

    The cubes of its layers have the size of the grid's, and the first of them lies in the frame's
    top left corner. So from the front they are those of the grid.

    Attributes:
        scene: The scene.
        camera: The camera.
    """

    scene: Scene
    camera: Camera

    @property
    def pitch(self) -> float:
        """Size of a cube in the frame, px."""
        return self.scene.grid.cell * self.camera.scale

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns that cover the frame."""
        return (
            math.ceil(self.camera.height / self.pitch - 1e-6),
            math.ceil(self.camera.width / self.pitch - 1e-6),
        )

    @cached_property
    def depths(self) -> Field:
        """Depth of each layer, (layers,) heights away from the camera."""
        grid = self.scene.grid
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
        layers, rows, columns = grid.shape
        right, down, away = grid.origin
        world = np.stack(
            [
                corners[:, 0] * columns - right,
                corners[:, 1] * layers - away,
                down - corners[:, 2] * rows,
            ],
            axis=1,
        )
        depth = self.camera.view_of(world)[:, 2]
        count = math.ceil(depth.max() - depth.min() - 1e-6)
        middle = (depth.max() + depth.min()) / 2
        return as_plane((np.arange(count) + 0.5 - count / 2 + middle) * grid.cell)

    @property
    def cubes(self) -> int:
        """Number of cubes that it sees."""
        rows, columns = self.size
        return len(self.depths) * rows * columns

    @property
    def is_plain(self) -> bool:
        """Whether the cubes that it sees are those of the grid."""
        return self.camera == self.camera.from_the_front() and not self.scene.detail

    def gas(self, scalars: Field, number: int) -> Field:
        """Return what is seen of the scalars (layers, rows, columns, 4) of frame ``number``."""
        if self.is_plain:
            left, top = self.scene.corner
            rows, columns = self.size
            seen = scalars[:, top : top + rows, left : left + columns]
            below = rows - seen.shape[1]  # the grid ends at the ground, the frame below it
            return np.pad(seen, ((0, 0), (0, below), (0, 0), (0, 0))) if below else seen
        x, y, z, above = self._places
        if self.scene.detail:
            x, y, z = self._displaced(x, y, z, number)
        found = look_up(scalars, places(self.scene.grid, x, y, z)).reshape(*x.shape, 4)
        found *= above[..., None]
        return found

    @cached_property
    def _places(self) -> tuple[Field, Field, Field, Field]:
        """Column, row and layer of the grid of each cube that is seen, and how much of it, 0..1, is
        above the grid's lower end: cut from cube to cube, a fire's foot would be drawn in lines."""
        grid, (rows, columns) = self.scene.grid, self.size
        seen = np.empty((len(self.depths), rows, columns, 3))
        seen[..., 0] = (np.arange(columns) + 0.5) * self.pitch
        seen[..., 1] = (np.arange(rows)[:, None] + 0.5) * self.pitch
        seen[..., 2] = self.depths[:, None, None]
        world = self.camera.unproject(seen) / grid.cell
        right, down, away = grid.origin
        x = as_plane(world[..., 0] + (right - 0.5))
        y = as_plane((down - 0.5) - world[..., 2])
        z = as_plane(world[..., 1] + (away - 0.5))
        above = as_plane(np.clip(grid.shape[1] - y, 0, 1))
        return x, y, z, above

    def _displaced(self, x: Field, y: Field, z: Field, number: int) -> tuple[Field, Field, Field]:
        """Return places that rising noise displaces."""
        scene, (layers, rows, columns) = self.scene, x.shape
        tiles = max(1, round(_RISE * scene.period / (_TILE * scene.grid.cell)))
        risen = round(tiles * _TILE * number / scene.frames)
        at = np.ix_(
            np.arange(layers) % _TILE, (np.arange(rows) + risen) % _TILE, np.arange(columns) % _TILE
        )
        far = np.float32(_FARTHEST * scene.detail)
        right, down, away = (channel[at] * far for channel in self._noise)
        return x + right, y + down, z + away

    @cached_property
    def _noise(self) -> Field:
        chance = generator(self.scene.seed, RandomStream.FINE_DETAIL)
        return curl_noise((_TILE, _TILE, _TILE), _WAVES, chance)
