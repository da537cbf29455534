"""How gas moves and burns in a plane: stable fluids.

Units: pixels and frames.  Fields are float32 arrays of shape ``(height, width)``, rows downwards.
"""

from __future__ import annotations

import cv2
import numpy as np
from noise import Field
from scipy.fft import dstn, idstn


def advect(q: Field, u: Field, v: Field, rows: Field, columns: Field, dt: float) -> Field:
    """Carry ``q`` along (u, v) for ``dt`` frames: midpoint back-trace, limited bicubic lookup."""
    half = np.float32(dt / 2)
    mid_x, mid_y = columns - half * u, rows - half * v
    back_x = columns - 2 * half * cv2.remap(u, mid_x, mid_y, cv2.INTER_LINEAR)
    back_y = rows - 2 * half * cv2.remap(v, mid_x, mid_y, cv2.INTER_LINEAR)
    sharp = cv2.remap(q, back_x, back_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    box = np.ones((3, 3), np.uint8)
    near_x, near_y = np.rint(back_x), np.rint(back_y)
    low = cv2.remap(cv2.erode(q, box), near_x, near_y, cv2.INTER_NEAREST)
    high = cv2.remap(cv2.dilate(q, box), near_x, near_y, cv2.INTER_NEAREST)
    return np.clip(sharp, low, high)


def burn(fuel: Field, life: float, dt: float, thinning: float) -> Field:
    """Use up fuel at a steady rate, faster where the flame is thin and loses its heat."""
    around = cv2.GaussianBlur(fuel, (0, 0), 4.0)
    loss = (1 + np.float32(thinning) * np.clip(fuel - around, 0, 1)) * np.float32(dt / life)
    return np.asarray(np.clip(fuel - loss, 0, 1), dtype=np.float32)


def curl(u: Field, v: Field) -> Field:
    """Vorticity of (u, v), 1/frame."""
    return np.asarray(np.gradient(v, axis=1) - np.gradient(u, axis=0), dtype=np.float32)


def confine(u: Field, v: Field, strength: float) -> tuple[Field, Field]:
    """Vorticity confinement: the acceleration that gives eddies back what the grid smears."""
    spin = curl(u, v)
    slope_y, slope_x = np.gradient(cv2.GaussianBlur(np.abs(spin), (0, 0), 1.0))
    size = np.sqrt(slope_x**2 + slope_y**2) + np.float32(1e-4)
    gain = np.float32(strength) * spin / size
    return np.asarray(slope_y * gain), np.asarray(-slope_x * gain)


def project(u: Field, v: Field, swelling: Field, laplacian: Field) -> tuple[Field, Field]:
    """Remove the divergence of (u, v) except for ``swelling``."""
    divergence = np.gradient(u, axis=1) + np.gradient(v, axis=0) - swelling
    waves = dstn(divergence.astype(np.float32), type=1) / laplacian
    slope_y, slope_x = np.gradient(idstn(waves, type=1))
    return u - slope_x, v - slope_y
