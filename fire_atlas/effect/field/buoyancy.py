"""Solve for the buoyancy field Bv: the Navier-Stokes equation with the fire's forces (eq. 12).

    ∂u/∂t = −(u·∇)u + μ ∇²u + U_buoyancy − drag · u [− ∇P]

is solved on a coarse grid (``forcing.py``), term by term: ``advect``, ``diffuse``, body forces with
drag (``effective_step``) and, optionally, ``project``. Each is stable for any time step.
"""

import math
from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.effect.field.forcing import Forcing, grid_shape
from fire_atlas.effect.field.wind import AmbientFlow
from fire_atlas.recipe.effect import Buoyancy
from fire_atlas.recipe.wind import Wind
from fire_atlas.vision.warp import between_copies, sample_at

_MAX_STEP = 1 / 20
"""Maximum time step, s: frames of slow clips are sub-stepped, so that no flow skips an eddy."""

_SPIN_UP, _SPIN_UP_STEPS = 2.5, 12
"""How long the first frame acts on still air before the clip begins, s, and in how many steps."""

LIFT = 1.2
"""Automatic lift of fully hot air, heights/s²."""

FEATURE_FORCE = 64.0
"""Automatic acceleration by a feature vector of average strength where κ is 1, heights/s². It is
large because edges are thin: air passes them in a moment."""

_UPDRAFT = 0.15
"""Gas rises faster than optical flow shows, by its lift times this, s: a steady flame looks still
while its gas rises."""

_COOLING = 0.3
"""Rate at which hot air cools, 1/s."""

_SATURATION = 0.2
"""Heat at which air has a little more than half its lift, so that a diluted plume still rises."""


@dataclass(frozen=True, slots=True)
class BuoyancyField:
    """State of the buoyancy field at one moment.

    Attributes:
        u, v: (rows, columns) float32 velocity, px/s.
        heat: (rows, columns) float32, 1 in the flame, 0 in cold air.
    """

    u: Plane
    v: Plane
    heat: Plane


@dataclass(frozen=True, slots=True)
class BuoyancySolver:
    """Solver of eq. 12: the recipe's ``buoyancy`` converted to px and s, and the ambient flow.

    Attributes:
        shape: (rows, columns) of the grid.
        cell: Side of a cell, px.
        coupling: Rate at which the field approaches the optical flow inside the flame, 1/s.
        drag: Rate at which motion relative to the ambient flow decays, 1/s.
        feature_force: Acceleration by a feature vector as long as the clip's mean ‖∇f‖, px/s².
        lift: (x, y) acceleration of fully hot air, px/s², y down.
        gravity: Downward acceleration, px/s².
        viscosity: μ, px²/s.
        projection: Whether each time step ends with ``project``.
        ambient: Wind and eddies, towards which drag pulls the field outside the flame.
        tiles: Whether the right side of the field joins its left one.
    """

    shape: tuple[int, int]
    cell: int
    coupling: float
    drag: float
    feature_force: float
    lift: tuple[float, float]
    gravity: float
    viscosity: float
    projection: bool
    ambient: AmbientFlow
    tiles: bool

    @classmethod
    def of(
        cls,
        buoyancy: Buoyancy,
        direction: tuple[float, float],
        clip: Clip,
        wind: Wind,
        seed: int,
        view: int = 0,
    ) -> Self:
        """Convert the recipe's section from heights to px.

        Args:
            buoyancy: The recipe's section.
            direction: Of the lift, a unit vector in image axes.
            clip: The clip; only its length, rate, size and whether it tiles are used.
            wind: The recipe's wind in the clip's view.
            seed: Random seed of the eddies.
            view: Number of the view, which has eddies of its own.
        """
        height, lift, force = clip.height, _lift_strength(buoyancy), buoyancy.feature_force
        return cls(
            shape=grid_shape(clip.width, height, buoyancy.cell),
            cell=buoyancy.cell,
            coupling=buoyancy.coupling if buoyancy.motion == "flow" else 0.0,
            drag=buoyancy.drag,
            feature_force=(FEATURE_FORCE if force == "auto" else force) * height,
            lift=(direction[0] * lift * height, direction[1] * lift * height),
            gravity=buoyancy.gravity * height,
            viscosity=buoyancy.viscosity * height**2,
            projection=buoyancy.projection,
            ambient=AmbientFlow.of(wind, buoyancy, clip, seed, view),
            tiles=clip.tiles,
        )

    def initial(self, forcing: Forcing) -> BuoyancyField:
        """Return the field at time 0, after ``forcing`` has acted on still air for a while.

        A few long steps will do, because only the final state counts.
        """
        zero, dt = np.zeros(self.shape, np.float32), _SPIN_UP / _SPIN_UP_STEPS
        field = BuoyancyField(zero, zero, zero)
        for step in range(-_SPIN_UP_STEPS, 0):
            field = self._step(field, forcing, step * dt, dt)
        return field

    def advance(
        self, field: BuoyancyField, forcing: Forcing, time: float, dt: float
    ) -> BuoyancyField:
        """Advance the field from ``time`` by a frame of ``dt`` s, in sub-steps if that is long."""
        steps = max(1, math.ceil(dt / _MAX_STEP - 1e-6))
        for step in range(steps):
            field = self._step(field, forcing, time + step * dt / steps, dt / steps)
        return field

    def _step(
        self, field: BuoyancyField, forcing: Forcing, time: float, dt: float
    ) -> BuoyancyField:
        """One time step of eq. 12: advection, viscosity, body forces and drag, projection.

        Inside the flame the field approaches the optical flow at the rate ``coupling``, and drag
        slows it; outside, drag pulls it towards the ambient flow.
        """
        ambient = self.ambient.velocity(time, self.shape)
        field = advect(field, dt, self.cell, tiles=self.tiles)
        field = diffuse(field, self.viscosity, dt, self.cell, tiles=self.tiles)
        rate = as_plane(forcing.flame * np.float32(self.coupling) + np.float32(self.drag))
        outside = as_plane(np.float32(self.drag) * (1.0 - forcing.flame))
        effective = effective_step(rate, dt)
        planes = []
        for velocity, (force, follow), around, weight in zip(
            (field.u, field.v), self._drive(field.heat, forcing), ambient, (0.0, self.gravity),
            strict=True,
        ):  # fmt: skip
            pull = follow + outside * around
            change = (force + weight) + pull - rate * velocity
            planes.append(as_plane(velocity + change * effective))
        u, v = project(*planes, tiles=self.tiles) if self.projection else planes
        heat = np.maximum(field.heat * np.float32(math.exp(-_COOLING * dt)), forcing.flame)
        return BuoyancyField(u, v, as_plane(heat))

    def buoyancy(self, heat: Plane, forcing: Forcing) -> tuple[Plane, Plane]:
        """U_buoyancy of eq. 12, the fire's own drive, x and y: (rows, columns), px/s².

        It is all that accelerates still air except for gravity and the ambient flow: lift, feature
        vectors and, inside the flame, the pull towards the optical flow.

        Args:
            heat: Of the field, (rows, columns), 0..1.
            forcing: The frame's.
        """
        x, y = (as_plane(force + follow) for force, follow in self._drive(heat, forcing))
        return x, y

    def _drive(self, heat: Plane, forcing: Forcing) -> tuple[tuple[Plane, Plane], ...]:
        """U_buoyancy for x and y, px/s²: lift and features; and what pulls air along the flow."""
        lifted = heat * np.float32(1 + _SATURATION) / (heat + np.float32(_SATURATION))
        coupled = forcing.flame * np.float32(self.coupling)
        return tuple(
            (
                lifted * np.float32(lift) + feature * np.float32(self.feature_force),
                coupled * (flow + np.float32(lift * _UPDRAFT)),
            )
            for lift, feature, flow in zip(
                self.lift, (forcing.feature_x, forcing.feature_y),
                (forcing.flow_x, forcing.flow_y), strict=True,
            )
        )  # fmt: skip


def lift_direction(buoyancy: Buoyancy) -> tuple[float, float] | None:
    """F_buoyancy of eq. 3: the unit vector of the lift in image axes; up where there is none.

    None if the recipe leaves it to the clip.
    """
    if buoyancy.lift == "auto":
        return None
    x, y = buoyancy.lift if isinstance(buoyancy.lift, tuple) else (0.0, buoyancy.lift)
    length = math.hypot(x, y)
    return (x / length, -y / length) if length > 0 else (0.0, -1.0)


def _lift_strength(buoyancy: Buoyancy) -> float:
    """Length of the recipe's lift, heights/s²."""
    lift = buoyancy.lift
    if lift == "auto":
        return LIFT
    return math.hypot(*lift) if isinstance(lift, tuple) else abs(lift)


def advect(field: BuoyancyField, dt: float, cell: int, *, tiles: bool = False) -> BuoyancyField:
    """Semi-Lagrangian self-advection over ``dt`` seconds: (u·∇)u of eq. 12. ``cell``: px.

    Planes are sampled one by one: for two-channel data OpenCV rounds coordinates to 1/32 px, which
    would stop slow air altogether.
    """
    x, y = _departures(field.u, field.v, dt, cell)
    planes = (field.u, field.v, field.heat)
    return BuoyancyField(*(sample_at(plane, x, y, tiles=tiles) for plane in planes))


def advect_plane(
    plane: Plane, u: Plane, v: Plane, dt: float, cell: int, *, tiles: bool = False
) -> Plane:
    """Return a plane (rows, columns) after the velocity (u, v), px/s, carried it for ``dt`` s.

    Sampled bicubically: what is carried far stays sharp, but may overshoot.
    """
    x, y = _departures(u, v, dt, cell)
    return as_plane(sample_at(plane, x, y, cv2.INTER_CUBIC, tiles=tiles))


def _departures(u: Plane, v: Plane, dt: float, cell: int) -> tuple[Plane, Plane]:
    """Return where the air at the middle of each cell was ``dt`` s before, cells."""
    rows, columns = u.shape
    x, y = np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32)[:, None]
    # Border values continue outside the frame, so tracing further back would change nothing.
    longest = float(2 * max(rows, columns))
    from_x = x - np.clip(u * np.float32(dt / cell), -longest, longest)
    from_y = y - np.clip(v * np.float32(dt / cell), -longest, longest)
    return as_plane(from_x), as_plane(from_y)


def diffuse(
    field: BuoyancyField, viscosity: float, dt: float, cell: int, *, tiles: bool = False
) -> BuoyancyField:
    """Viscosity μ ∇²u over ``dt`` seconds, by the exact solution of the heat equation: a Gaussian.

    Args:
        field: State.
        viscosity: μ, px²/s.
        dt: Time step, s.
        cell: Side of a cell, px.
        tiles: Whether the right side of the field joins its left one.
    """
    sigma = min(math.sqrt(2 * viscosity * dt) / cell, max(field.u.shape))
    if sigma < 0.05:  # the kernel is a single tap
        return field
    reach = math.ceil(3 * sigma)
    size, margin, columns = (2 * reach + 1,) * 2, reach if tiles else 0, field.u.shape[1]
    blurred = (
        cv2.GaussianBlur(between_copies(p, margin), size, sigma, borderType=cv2.BORDER_REPLICATE)
        for p in (field.u, field.v, field.heat)
    )
    return BuoyancyField(*(as_plane(p[:, margin : margin + columns]) for p in blurred))


def effective_step(rate: Plane, dt: float) -> Plane:
    """Time step (s) with which an explicit step of dw/dt = force + rate (target − w) is exact.

    w(dt) = w + (force + rate (target − w)) · effective_step; ``rate``: 1/s, >= 0.
    """
    exponent = rate * np.float32(dt)
    # (1 − e^−x)/x, whose limit at 0 is 1.
    share = np.where(exponent > 1e-6, -np.expm1(-exponent) / np.maximum(exponent, 1e-6), 1.0)
    return as_plane(share * np.float32(dt))


def project(u: Plane, v: Plane, *, tiles: bool = False) -> tuple[Plane, Plane]:
    """Make a field (rows, columns) divergence-free: −∇P of eq. 12, solved spectrally.

    The field is mirrored at every border (u odd in x, v odd in y), so that the periodic transform
    sees closed walls instead of the opposite side. The sides of a field that ``tiles`` are open to
    one another.
    """
    rows, columns = u.shape
    wide, tall = np.vstack([u, u[::-1]]), np.vstack([v, -v[::-1]])
    if not tiles:
        wide, tall = np.hstack([wide, -wide[:, ::-1]]), np.hstack([tall, tall[:, ::-1]])
    su, sv = np.fft.rfft2(wide), np.fft.rfft2(tall)
    kx = np.fft.rfftfreq(wide.shape[1])[None].astype(np.float32)
    ky = np.fft.fftfreq(2 * rows)[:, None].astype(np.float32)
    square = kx**2 + ky**2
    square[0, 0] = 1.0
    along = (su * kx + sv * ky) / square
    shape = wide.shape
    free_u = np.fft.irfft2(su - along * kx, s=shape)[:rows, :columns]
    free_v = np.fft.irfft2(sv - along * ky, s=shape)[:rows, :columns]
    return as_plane(free_u), as_plane(free_v)
