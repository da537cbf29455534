"""Keep the flow free of sources: subtract the gradient of the pressure that solves ∇²p = ∇·u − s.

J. Stam, "Stable Fluids" (1999), with the transforms of a box whose sides are open: the pressure is
zero half a cube outside of them (DST-II), and on solid ground its slope is (DST-IV from the open
top down). Divergence and gradient are central differences, and what is divided by in the
transform is their own product, −Σ sin²θ, not that of nearest neighbours: what they measure is gone
to the last bits, in one pass.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.fft

from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.grid import Field, FluidGrid

_OPEN, _GROUND = 2, 4
"""Types of discrete sine transform along an axis that is open, and one that ends at the ground."""

_LEAST = 1e-4
"""Eigenvalue below which a wave has no slope that central differences see: it changes sign from
cube to cube along all axes."""


@dataclass(frozen=True)
class Projection:
    """The projection in a grid.

    Attributes:
        grid: The grid.
        eigenvalue: (layers, rows, columns) −Σ sin²θ of each wave, per cube².
    """

    grid: FluidGrid
    eigenvalue: Field

    @classmethod
    def of(cls, grid: FluidGrid) -> Self:
        """Prepare the projection in a grid."""
        layers, rows, columns = (
            np.sin(np.pi * (np.arange(n) + (0.5 if grid.has_ground and axis == 1 else 1)) / n) ** 2
            for axis, n in enumerate(grid.shape)
        )
        total = layers[:, None, None] + rows[:, None] + columns
        return cls(grid, np.where(total > _LEAST, -total, -np.inf).astype(np.float32))

    def divergence(self, velocity: Field, workers: Workers) -> Field:
        """Return the divergence, 1/s, of a velocity (layers, rows, columns, 4)."""
        found, layers = self.grid.empty(), self.grid.shape[0]
        half = np.float32(0.5 / self.grid.cell)

        def work(part: slice) -> None:
            u, v = velocity[part, ..., 0], velocity[part, ..., 1]
            total = found[part]
            total[..., 1:-1] = u[..., 2:] - u[..., :-2]
            total[..., 0], total[..., -1] = u[..., 1] - u[..., 0], u[..., -1] - u[..., -2]
            total[:, 1:-1] += v[:, 2:] - v[:, :-2]
            total[:, 0] += v[:, 1] - v[:, 0]
            # Nothing passes the ground: below it the gas moves up as it moves down above.
            total[:, -1] -= v[:, -2] + v[:, -1] if self.grid.has_ground else v[:, -2] - v[:, -1]
            for k in range(part.start, part.stop):
                ahead, behind = min(k + 1, layers - 1), max(k - 1, 0)
                found[k] += velocity[ahead, ..., 2] - velocity[behind, ..., 2]
            total *= half

        self.grid.each_part(workers, work)
        return found

    def project(self, velocity: Field, source: Field, workers: Workers) -> None:
        """Change a velocity (layers, rows, columns, 4), in place, so that its divergence is
        ``source``, 1/s."""
        rest = self.divergence(velocity, workers)
        rest -= source
        down = _GROUND if self.grid.has_ground else _OPEN

        def solve(part: slice) -> None:
            waves = scipy.fft.dst(rest[part], down, axis=1)
            waves = scipy.fft.dst(waves, _OPEN, axis=2, overwrite_x=True)
            np.divide(waves, self.eigenvalue[part], out=rest[part])

        def back(part: slice) -> None:
            waves = scipy.fft.idst(rest[part], down, axis=1)
            rest[part] = scipy.fft.idst(waves, _OPEN, axis=2, overwrite_x=True)

        rest = scipy.fft.dst(rest, _OPEN, axis=0, overwrite_x=True, workers=workers.jobs)
        self.grid.each_part(workers, solve)
        rest = scipy.fft.idst(rest, _OPEN, axis=0, overwrite_x=True, workers=workers.jobs)
        self.grid.each_part(workers, back)
        # In cubes, as the eigenvalues are: the pressure is that by the edge of a cube squared.
        self._subtract_slopes(velocity, rest, workers)

    def _subtract_slopes(self, velocity: Field, pressure: Field, workers: Workers) -> None:
        """Subtract the slopes of a pressure from a velocity, in place."""
        layers, half = self.grid.shape[0], np.float32(0.5 * self.grid.cell)

        def work(part: slice) -> None:
            p = pressure[part] * half
            u, v = velocity[part, ..., 0], velocity[part, ..., 1]
            u[..., 1:-1] -= p[..., 2:] - p[..., :-2]
            u[..., 0] -= p[..., 1] + p[..., 0]
            u[..., -1] += p[..., -1] + p[..., -2]
            v[:, 1:-1] -= p[:, 2:] - p[:, :-2]
            v[:, 0] -= p[:, 1] + p[:, 0]
            v[:, -1] += p[:, -2] - p[:, -1] if self.grid.has_ground else p[:, -2] + p[:, -1]
            for k in range(part.start, part.stop):
                ahead = pressure[k + 1] if k + 1 < layers else -pressure[k]
                behind = pressure[k - 1] if k else -pressure[k]
                velocity[k, ..., 2] -= (ahead - behind) * half

        self.grid.each_part(workers, work)
