"""The colours of black bodies by their temperature."""

import numpy as np
from numpy.typing import NDArray

# CIE 1931 colour matching functions as sums of lobes (Wyman, Sloan & Shirley 2013): height, peak
# wavelength (nm), 1/width below and above the peak.
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


def radiance(kelvin: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the light of black bodies, linear sRGB (n, 3) up to one common factor, by Planck's law
    (eq. 16 of Balci & Foroosh): B(λ) ∝ λ⁻⁵ / (exp(hc/λkT) − 1)."""
    wave = np.arange(380.0, 781.0, 5.0)
    glow = wave**-5 / np.expm1(_PLANCK / (wave * np.asarray(kelvin, np.float64)[:, None]))
    seen = [
        sum(h * np.exp(-0.5 * ((wave - m) * np.where(wave < m, a, b)) ** 2) for h, m, a, b in lobes)
        for lobes in (_X, _Y, _Z)
    ]
    xyz = np.einsum("nw,cw->nc", glow, np.stack(seen))
    return np.asarray(np.maximum(np.einsum("nc,rc->nr", xyz, _SRGB), 0.0))


def blackbody(kelvin: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the colours of black bodies: linear sRGB (n, 3), brightest channel 1."""
    rgb = radiance(kelvin)
    return np.asarray(rgb / rgb.max(axis=1, keepdims=True))
