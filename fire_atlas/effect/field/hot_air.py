"""The hot air of a fire: how thin the heat makes it that the buoyancy field carries (eq. 12).

The density of air falls as 1 / T where the pressure is even. Turbulence stirs it.
"""

import math
from collections.abc import Iterator

import numpy as np

from fire_atlas.core.chance import RandomStream, generator
from fire_atlas.core.noise import PlaneWaves, WavesOnGrid, in_whole_cycles, random_wave_vectors
from fire_atlas.core.pixels import Plane, as_plane
from fire_atlas.effect.field.buoyancy import advect_plane
from fire_atlas.effect.field.record import FieldRecord

_FLAME_HEAT = 3.0
"""Temperature of flame above that of cold air, relative to it: about 900 °C in air of 20 °C."""

_FLUCTUATION = 0.25
"""Rms of the turbulent fluctuations of how thin the hot air is, relative to their mean."""

_EDDIES, _WAVELENGTHS, _FREQUENCIES = 32, (0.08, 0.25), (1.0, 4.0)
"""Number of the waves that stir the heat, their shortest and longest wavelength, heights, and
their lowest and highest frequency, Hz."""

_LIFE = 0.35
"""Time constant with which a fluctuation mixes with the air around it, s."""

_WARM_UP = 6
"""Fluctuations begin this many of their lives before the first frame, so that a loop of them
closes."""


def thinness(field: FieldRecord, height: int, seed: int) -> Iterator[Plane]:
    """Yield how much less dense than cold air the air of each frame of a field is, (rows, columns).

    Args:
        field: The field, with its heat.
        height: Of the frame, px.
        seed: Of the turbulence.
    """
    assert field.heat is not None, "whoever asks for hot air has its heat recorded"
    for heat, swing in zip(field.heat, _swings(field, height, seed), strict=True):
        yield as_plane(swing * (1 - 1 / (1 + _FLAME_HEAT * heat.astype(np.float32))))


def _swings(field: FieldRecord, height: int, seed: int) -> Iterator[Plane]:
    """Yield the factor by turbulence, (rows, columns), of how thin the hot air of each frame is.

    Random waves stir the air everywhere, the field carries what they stir, and it fades: a
    first-order autoregressive process along the way of the air, of constant variance. It loops with
    the field: the waves have whole cycles in it.
    """
    frames, step = len(field.u), 1 / field.fps
    waves = _waves(field, height, seed)
    kept = np.float32(math.exp(-step / _LIFE))
    stirred = np.float32(_FLUCTUATION * math.sqrt(1 - kept * kept))
    swing = np.zeros(field.u.shape[1:], np.float32)
    for n in range(-math.ceil(_WARM_UP * _LIFE * field.fps), frames):
        i = n % frames if field.loop else max(n, 0)
        carried = advect_plane(swing, field.u[i], field.v[i], step, field.cell, tiles=field.tiles)
        swing = carried * kept + waves.values(n * step) * stirred
        if n >= 0:
            yield np.clip(1 + swing, 0, 2)


def _waves(field: FieldRecord, height: int, seed: int) -> WavesOnGrid:
    """Return random waves of mean square 1 on the grid of a field; in a loop, with whole cycles."""
    chance = generator(seed, RandomStream.HAZE)
    _, kx, ky = random_wave_vectors(chance, _EDDIES, _WAVELENGTHS, height / field.cell)
    if field.tiles:
        kx = in_whole_cycles(kx, field.u.shape[2])
    frequency = chance.uniform(*_FREQUENCIES, _EDDIES)
    if field.loop:
        period = len(field.u) / field.fps
        frequency = np.maximum(np.rint(frequency * period), 1) / period
    omega = 2 * np.pi * frequency * chance.choice([-1.0, 1.0], _EDDIES)
    phase = chance.uniform(0, 2 * np.pi, _EDDIES)
    waves = PlaneWaves(kx, ky, omega, phase, np.full(_EDDIES, math.sqrt(2 / _EDDIES)))
    rows, columns = field.u.shape[1:]
    return waves.on_grid(np.arange(columns, dtype=np.float64), np.arange(rows, dtype=np.float64))
