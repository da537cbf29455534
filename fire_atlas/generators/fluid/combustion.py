"""Burn fuel: it becomes heat and smoke, faster where it is thin, and what is hot cools.

The scalars of a gas are its fuel (1 at a burner), its temperature (1: as hot as the fire's fuel
gets), and its smoke (1: all that the fuel can give).
"""

from dataclasses import dataclass

import numpy as np

from fire_atlas.core.pixels import as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.generators.fluid.grid import Field, FluidGrid

FUEL, TEMPERATURE, SMOKE = 0, 1, 2
"""Channels of the scalars."""

_SKIN = 2
"""Distance, cubes, of the six places whose mean says whether fuel is thin."""


@dataclass(frozen=True, slots=True)
class Chemistry:
    """How gas burns.

    Attributes:
        life: Time in which fuel burns, s.
        thinning: How much faster fuel burns for each 1 that it is above its surroundings.
        heating: Temperature that comes of a whole fuel.
        cooling: Rate at which gas of temperature 1 cools, 1/s.
        soot: Smoke that comes of a whole fuel.
        dissipation: Rate at which smoke thins, 1/s.
    """

    life: float
    thinning: float
    heating: float
    cooling: float
    soot: float
    dissipation: float


def burn(
    grid: FluidGrid,
    scalars: Field,
    chemistry: Chemistry,
    fading: Field,
    dt: float,
    workers: Workers,
) -> tuple[Field, Field]:
    """Burn gas for ``dt`` s, in place.

    Fuel burns at the rate 1 / life, so a flame ends where its fuel has burnt so long. Radiation
    cools with the fourth power of the temperature, t (0.15 + t³), thin air with the first.

    Args:
        grid: The grid.
        scalars: (layers, rows, columns, 4).
        chemistry: How it burns.
        fading: (layers, rows, columns) share that is kept: less at the border of the box.
        dt: Time step, s.
        workers: Threads for the slabs.

    Returns:
        The fuel that burnt in this step, and the temperature.
    """
    life, thinning, heating, soot, cooling = (
        np.float32(value)
        for value in (
            dt / chemistry.life,
            chemistry.thinning,
            chemistry.heating,
            chemistry.soot,
            dt * chemistry.cooling,
        )
    )
    kept = np.float32(max(0.0, 1 - dt * chemistry.dissipation))
    fuel, burnt, temperature = (grid.empty() for _ in range(3))

    def separate(part: slice) -> None:
        fuel[part] = scalars[part, ..., FUEL]

    def work(part: slice) -> None:
        gas, around, present = scalars[part], _mean_around(fuel, part), fuel[part]
        loss = np.clip(present - around, 0, 1)
        loss *= thinning
        loss += 1
        loss *= life
        np.minimum(loss, present, out=loss)
        hot = gas[..., TEMPERATURE] + heating * loss
        hot -= cooling * hot * (np.float32(0.15) + hot * hot * hot)
        np.maximum(hot, 0, out=hot)
        hot *= fading[part]
        gas[..., FUEL] = (present - loss) * fading[part]
        gas[..., TEMPERATURE] = hot
        gas[..., SMOKE] = (gas[..., SMOKE] + soot * loss) * kept * fading[part]
        burnt[part], temperature[part] = loss, hot

    grid.each_part(workers, separate)
    grid.each_part(workers, work)
    return burnt, temperature


def smoothed(values: Field, layers: slice) -> Field:
    """Return some layers of values under the filter (1, 2, 1) / 4 along each axis."""
    found, last = np.empty_like(values[layers]), len(values) - 1
    for k in range(layers.start, layers.stop):
        around = values[max(k - 1, 0)] + values[min(k + 1, last)] + 2 * values[k]
        rows = 2 * around
        rows[1:] += around[:-1]
        rows[:-1] += around[1:]
        columns = 2 * rows
        columns[:, 1:] += rows[:, :-1]
        columns[:, :-1] += rows[:, 1:]
        found[k - layers.start] = columns * np.float32(1 / 64)
    return found


def _mean_around(values: Field, part: slice) -> Field:
    """Return the mean of six values around each cube of some layers."""
    layers = np.arange(part.start, part.stop)
    last = len(values) - 1
    total = values[np.maximum(layers - _SKIN, 0)] + values[np.minimum(layers + _SKIN, last)]
    own = values[part]
    for axis in (1, 2):
        inner = np.pad(own, [(_SKIN, _SKIN) if k == axis else (0, 0) for k in range(3)], "edge")
        size = own.shape[axis]
        ahead, behind = (
            tuple(slice(begin, begin + size) if k == axis else slice(None) for k in range(3))
            for begin in (2 * _SKIN, 0)
        )
        total += inner[ahead]
        total += inner[behind]
    return as_plane(total * np.float32(1 / 6))
