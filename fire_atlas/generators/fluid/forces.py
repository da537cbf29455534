"""What moves gas: its lift, the swirl that a grid smears, stirring where it is hot, and drag."""

from dataclasses import dataclass

import numpy as np

from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.grid import Field, FluidGrid, slope
from fire_atlas.generators.fluid.noise import Stirring


@dataclass(frozen=True, slots=True)
class Forces:
    """What moves gas.

    Attributes:
        lift: Upward acceleration of gas of temperature 1, heights/s².
        confinement: Vorticity confinement, 1/s.
        stirring: Acceleration by which hot gas is stirred, heights/s² (rms).
        drag: Rate at which gas slows down, 1/s.
    """

    lift: float
    confinement: float
    stirring: float
    drag: float


_LEAST_SLOPE = np.float32(1e-4)
"""Slope of the vorticity, of a velocity of 1 height/s a cube, below which there is no eddy."""


def push(
    grid: FluidGrid,
    velocity: Field,
    temperature: Field,
    forces: Forces,
    stirring: Stirring,
    time: float,
    dt: float,
    workers: Workers,
) -> None:
    """Let forces act on a velocity (layers, rows, columns, 4) for ``dt`` s, in place.

    The lift acts on the hot gas alone; that it has to push cold air aside (added mass) is the
    projection's. Vorticity confinement is f = ε h (N × ω), N = ∇|ω| / |∇|ω|| (R. Fedkiw, J. Stam
    and H. W. Jensen, "Visual Simulation of Smoke", 2001).

    Args:
        grid: The grid.
        velocity: What is changed.
        temperature: (layers, rows, columns) of the gas.
        forces: How strong they are.
        stirring: The noise that stirs.
        time: Time, s, of the noise.
        dt: Time step, s.
        workers: Threads for the slabs.
    """
    spin = [grid.empty() for _ in range(3)]
    strength = grid.empty()

    def curl(part: slice) -> None:
        first = max(part.start - 1, 0)
        around, own = velocity[first : part.stop + 1], slice(part.start - first, part.stop - first)
        u, v, w = (np.ascontiguousarray(around[..., channel]) for channel in range(3))
        spin[0][part] = slope(w, own, 1) - slope(v, own, 0)
        spin[1][part] = slope(u, own, 0) - slope(w, own, 2)
        spin[2][part] = slope(v, own, 2) - slope(u, own, 1)
        squares = [axis[part] * axis[part] for axis in spin]
        strength[part] = np.sqrt(squares[0] + squares[1] + squares[2])

    lift, stirred = np.float32(forces.lift * dt), np.float32(forces.stirring * dt)
    confined, kept = np.float32(forces.confinement * dt), np.float32(max(0.0, 1 - forces.drag * dt))
    noise = stirring.weights(time)

    def act(part: slice) -> None:
        gx, gy, gz = (slope(strength, part, axis) for axis in (2, 1, 0))
        steep = confined / (np.sqrt(gx * gx + gy * gy + gz * gz) + _LEAST_SLOPE)
        a, b, c = (axis[part] for axis in spin)
        hot, moved = temperature[part], velocity[part]
        forced = [steep * (gy * c - gz * b), steep * (gz * a - gx * c), steep * (gx * b - gy * a)]
        forced[1] -= lift * hot
        if stirred and hot.any():
            share = stirred * np.minimum(hot, 1)
            for channel in range(3):
                forced[channel] += share * stirring.at(noise, channel, part)
        for channel in range(3):
            moved[..., channel] += forced[channel]
        moved *= kept

    grid.each_part(workers, curl)
    grid.each_part(workers, act)
