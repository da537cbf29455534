"""The buoyancy field Bv: equation 12 carried from frame to frame on a coarse grid."""

import math
from dataclasses import dataclass

import numpy as np

from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.effect.field.air import Air, advect, diffuse, gain, still_air
from fire_atlas.effect.field.ambient import Ambient
from fire_atlas.effect.field.projection import project
from fire_atlas.recipe.effect import Buoyancy

_LONGEST_STEP = 1 / 20
"""Slow clips are sub-stepped, so that air does not jump over eddies. s."""

_SETTLING, _SETTLING_STEPS = 2.5, 12
"""Seconds for which the first frame acts on the air before a clip begins, and in how many steps."""

_UPDRAFT = 0.15
"""Air in the flame rises by the lift of this many seconds against what the eye follows: the
pattern of a steady flame stands still while its gas goes up."""

_COOLING = 0.3
"""Rate at which hot air cools, 1/s."""

_TEPID = 0.2
"""Heat at which air has little more than half of its lift: a plume that mixes still carries."""


@dataclass(frozen=True, slots=True)
class Drive:
    """What one frame of the clip does to the air. All planes (rows, columns) float32.

    Attributes:
        flame: How much of each cell is flame, 0..1.
        lit: How bright each cell is, 0..1, flame or not.
        flow_x, flow_y: Optical flow there, px/s.
        feature_x, feature_y: Mean Fv* of each cell, in units of the clip's typical ‖Fv‖.
    """

    flame: Plane
    lit: Plane
    flow_x: Plane
    flow_y: Plane
    feature_x: Plane
    feature_y: Plane


@dataclass(frozen=True, slots=True)
class Physics:
    """The recipe's ``buoyancy`` in px and s.

    Attributes:
        cell: px.
        coupling, drag: 1/s.
        feature_force: Acceleration by one typical feature vector, px/s².
        lift: (x, y) acceleration of fully hot air, px/s², y down.
        gravity: Downward acceleration, px/s².
        viscosity: px²/s.
        projection: Whether each step ends divergence-free.
    """

    cell: int
    coupling: float
    drag: float
    feature_force: float
    lift: tuple[float, float]
    gravity: float
    viscosity: float
    projection: bool

    @classmethod
    def of(cls, buoyancy: Buoyancy, height: int) -> "Physics":
        """Turn heights into px for frames of ``height`` px."""
        lift = buoyancy.lift
        x, y = lift if isinstance(lift, tuple) else (0.0, lift)
        return cls(
            cell=buoyancy.cell,
            coupling=buoyancy.coupling if buoyancy.motion == "flow" else 0.0,
            drag=buoyancy.drag,
            feature_force=buoyancy.feature_force * height,
            lift=(x * height, -y * height),
            gravity=buoyancy.gravity * height,
            viscosity=buoyancy.viscosity * height**2,
            projection=buoyancy.projection,
        )


def lift_direction(buoyancy: Buoyancy) -> tuple[float, float]:
    """F_buoyancy of eq. 3: the unit vector of the lift in image axes; up where there is none."""
    lift = buoyancy.lift
    x, y = lift if isinstance(lift, tuple) else (0.0, lift)
    length = math.hypot(x, y)
    return (x / length, -y / length) if length > 0 else (0.0, -1.0)


def settle(drive: Drive, ambient: Ambient, physics: Physics, shape: tuple[int, int]) -> Air:
    """Air as it moves after ``drive`` has acted on it for a while, at time 0.

    In a few long steps: all that matters is where they end.
    """
    air, dt = still_air(shape), _SETTLING / _SETTLING_STEPS
    for step in range(-_SETTLING_STEPS, 0):
        around = ambient.velocity(step * dt, shape)
        air = _substep(air, drive, around, physics, dt)
    return air


def advance(
    air: Air, drive: Drive, ambient: Ambient, physics: Physics, time: float, dt: float
) -> Air:
    """Carry the air from ``time`` over one frame of ``dt`` seconds under ``drive``."""
    steps = max(1, math.ceil(dt / _LONGEST_STEP - 1e-6))
    for step in range(steps):
        around = ambient.velocity(time + step * dt / steps, air.u.shape)
        air = _substep(air, drive, around, physics, dt / steps)
    return air


def _substep(
    air: Air, drive: Drive, around: tuple[Plane, Plane], physics: Physics, dt: float
) -> Air:
    """One step of eq. 12: advection, viscosity, body forces and drag, projection.

    Inside the flame the air follows the flow at the finite rate ``coupling``; everywhere drag draws
    it towards the air around, whose wind and eddies do not reach into the flame.
    """
    air = diffuse(advect(air, dt, physics.cell), physics.viscosity, dt, physics.cell)
    follow = drive.flame * np.float32(physics.coupling)
    rate = as_plane(follow + np.float32(physics.drag))
    outside = as_plane(np.float32(physics.drag) * (1.0 - drive.flame))
    lifted = air.heat * np.float32(1 + _TEPID) / (air.heat + np.float32(_TEPID))
    acted = gain(rate, dt)
    planes = []
    for velocity, feature, flow, calm, lift, weight in (
        (air.u, drive.feature_x, drive.flow_x, around[0], physics.lift[0], 0.0),
        (air.v, drive.feature_y, drive.flow_y, around[1], physics.lift[1], physics.gravity),
    ):
        force = lifted * np.float32(lift) + feature * np.float32(physics.feature_force) + weight
        pull = follow * (flow + np.float32(lift * _UPDRAFT)) + outside * calm
        planes.append(as_plane(velocity + (force + pull - rate * velocity) * acted))
    u, v = project(*planes) if physics.projection else planes
    heat = np.maximum(air.heat * np.float32(math.exp(-_COOLING * dt)), drive.flame)
    return Air(u, v, as_plane(heat))
