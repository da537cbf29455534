"""Flying flakes: their state at one moment, and how each camera sees flakes that fly in depth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.effect.flakes.emission import Spawns

Column = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ParticleState:
    """Flakes alive at one moment, sorted by id. Arrays (flakes,).

    Attributes:
        id: Index of each in its ``Spawns``.
        x, y: Place, px.
        vx, vy: Velocity, px/s.
        smoothed_speed: Speed, px/s, exponentially smoothed over time.
        exposure: How far outside the flame it has been over its last moments, 0..1.
        age: Seconds since the flake was spawned.
        z, vz: Place, px, and velocity, px/s, in depth, towards the viewer; 0 in a flat clip.
    """

    id: NDArray[np.int64]
    x: Column
    y: Column
    vx: Column
    vy: Column
    smoothed_speed: Column
    exposure: Column
    age: Column
    z: Column
    vz: Column

    @classmethod
    def empty(cls) -> Self:
        """Return no flakes."""
        return cls(np.empty(0, np.int64), *(np.empty(0) for _ in fields(cls)[1:]))

    def where(self, kept: NDArray[np.bool_]) -> "ParticleState":
        """Return the flakes at which the mask is true."""
        places = np.flatnonzero(kept)
        if len(places) == len(kept):
            return self
        return ParticleState(*(getattr(self, f.name).take(places) for f in fields(self)))

    @classmethod
    def concatenate(cls, parts: Sequence["ParticleState"]) -> Self:
        """Return the flakes of all parts, one part after the other."""
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))


@dataclass(frozen=True, slots=True)
class FlakeView:
    """A camera that sees flakes which fly in the px of the front of a fire with depth.

    Attributes:
        front: The camera in whose px they fly: level, with parallel lines of sight.
        camera: The camera that sees them.
        hidden: ``hidden(i, x, y, z)`` returns which places (n,) in the view, px, are behind
            something opaque in frame i.
    """

    front: Camera
    camera: Camera
    hidden: Callable[[int, Column, Column, Column], NDArray[np.bool_]]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frame, px."""
        return self.camera.width, self.camera.height

    def seen(self, state: ParticleState) -> ParticleState:
        """Return places and velocities as the camera projects them, in the units of ``Tracks``."""
        world = self._world(state.x, state.y, state.z)
        per_unit = np.array([1, 1, -1]) / self.front.scale
        velocity = np.stack([state.vx, state.vy, state.vz], axis=-1) * per_unit @ self.front.axes()
        x, y, z = self._projected(world)
        vx, vy = self.camera.project_velocities(world, velocity).T
        vz = self.camera.view_of(velocity)[:, 2] * -self.camera.scale
        return replace(state, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)

    def seen_spawns(self, spawns: Spawns) -> Spawns:
        """Return spawns with the places that the camera sees; all else stays as it is."""
        x, y, z = self._projected(self._world(spawns.x, spawns.y, spawns.z))
        return replace(spawns, x=x, y=y, z=z)

    def magnification(self, z: Column) -> Column:
        """Return how much larger flakes at ``z`` in the view, px, appear than in its middle."""
        return self.camera.magnification(z / -self.camera.scale)

    def _world(self, x: Column, y: Column, z: Column) -> NDArray[np.float64]:
        return self.front.unproject(np.stack([x, y, z / -self.front.scale], axis=-1))

    def _projected(self, world: NDArray[np.float64]) -> tuple[Column, Column, Column]:
        x, y, depth = self.camera.project(world).T
        return x, y, depth * -self.camera.scale
