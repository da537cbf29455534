"""From heat to light: a fuel's own colours, or those of a black body."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import hex_to_linear

HEAT = np.linspace(0.0, 1.25, 512)
"""Heats for which colours are tabled."""

_LOWEST = 900.0
"""K of the faintest flame that is seen."""

# CIE 1931 colour matching functions as sums of half-Gaussians (Wyman, Sloan & Shirley 2013):
# height, wavelength (nm), 1/width below and above it.
_X = (
    (1.056, 599.8, 0.0264, 0.0323),
    (0.362, 442.0, 0.0624, 0.0374),
    (-0.065, 501.1, 0.0490, 0.0382),
)
_Y = ((0.821, 568.8, 0.0213, 0.0247), (0.286, 530.9, 0.0613, 0.0322))
_Z = ((1.217, 437.0, 0.0845, 0.0278), (0.681, 459.0, 0.0385, 0.0725))

_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
"""From XYZ to linear sRGB (IEC 61966-2-1)."""

_PLANCK = 1.438777e7
"""hc/k, nm K."""


def blackbody(kelvin: NDArray[np.floating]) -> NDArray[np.float64]:
    """Linear sRGB (n, 3) of black bodies, the brightest channel 1, by Planck's law (eq. 16).

    The inverse that eq. 16 lacks in print is in: B(λ) ∝ λ⁻⁵ / (exp(hc/λkT) − 1).
    """
    wave = np.arange(380.0, 781.0, 5.0)
    glow = wave**-5 / np.expm1(_PLANCK / (wave * np.asarray(kelvin, np.float64)[:, None]))
    seen = [
        sum(h * np.exp(-0.5 * ((wave - m) * np.where(wave < m, a, b)) ** 2) for h, m, a, b in lobes)
        for lobes in (_X, _Y, _Z)
    ]
    xyz = np.einsum("nw,cw->nc", glow, np.stack(seen))
    rgb = np.maximum(np.einsum("nc,rc->nr", xyz, _SRGB), 0.0)
    return np.asarray(rgb / rgb.max(axis=1, keepdims=True))


def ramp_colours(ramp: tuple[str, ...], reach: float = 1.0) -> NDArray[np.float64]:
    """Linear colour (512, 3) of each of ``HEAT``, along sRGB hex colours from cool to hot, of which
    a heat of 1 comes as far as ``reach``."""
    stops = hex_to_linear(ramp).astype(np.float64)
    at = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(HEAT * reach, at, stops[:, c]) for c in range(3)], axis=1)


def body_colours(hottest: float) -> NDArray[np.float64]:
    """Linear colour (512, 3) of each of ``HEAT``, as a black body of up to ``hottest`` K."""
    return blackbody(_LOWEST + (hottest - _LOWEST) * np.minimum(HEAT, 1.25) ** 0.7)


def light_table(colours: NDArray[np.float64], light: float, contrast: float) -> NDArray[np.float32]:
    """Light (512, 3) that each of ``HEAT`` gives: its colour, times heat to the ``contrast``."""
    return (colours * (light * HEAT**contrast)[:, None]).astype(np.float32)


def graded(heat: NDArray[np.float32], table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Light (..., 3) of ``heat`` (...), between the entries of a table."""
    at = np.clip(heat, 0.0, float(HEAT[-1])) * np.float32((len(HEAT) - 1) / HEAT[-1])
    below = np.minimum(at.astype(np.intp), len(HEAT) - 2)
    share = (at - below.astype(np.float32))[..., None]
    low = table[below]
    return np.asarray(low + (table[below + 1] - low) * share, np.float32)


def exposed(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """HDR light as a film takes it, 0..1: channel by channel, so that the brightest turns from
    orange over yellow to white."""
    return np.asarray(-np.expm1(-light), np.float32)
