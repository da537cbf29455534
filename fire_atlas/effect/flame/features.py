"""Feature vectors of a frame: the edges of the fire and where they lead (Kim & Lee, eq. 1-3).

Brightness is on the 0..255 scale; on it the paper's ε = 40, α = 0.03 and β = 0.02 agree with each
other. Image axes: x right, y down.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from fire_atlas.core.pixels import Plane, as_plane, magnitude


class Box(NamedTuple):
    """A box in a frame: its first and last columns and rows, px."""

    left: float
    top: float
    right: float
    bottom: float


def difference_of_gaussians(brightness: Plane, sigma: tuple[float, float]) -> Plane:
    """Edges f^DoG of a picture (eq. 1): the wide Gaussian less the narrow one, of unit sum each.

    The printed prefactor 1/(√(2π) σ) is that of a one-dimensional Gaussian: in two dimensions its
    f^DoG = G_σ1 − G_σ2 sums to √(2π) (σ1 − σ2), and a flat picture would have edges. As that is
    negative, bright places are low in it and its gradient leads out of the light: at the foot of a
    flame down, which κ is there to stop (Figure 8), and at the tips up. Of unit sums it is
    G_σ2 − G_σ1 whose gradient does.

    Args:
        brightness: (H, W), 0..255.
        sigma: (σ1, σ2), px, σ1 <= σ2.

    Returns:
        (H, W), 0 where the picture is flat, negative on the bright side of an edge.
    """
    narrow = _gaussian(brightness, sigma[0])
    wide = _gaussian(narrow, math.sqrt(max(sigma[1] ** 2 - sigma[0] ** 2, 0.0)))
    return as_plane(cv2.subtract(wide, narrow, dst=wide))


def gradient(plane: Plane) -> tuple[Plane, Plane]:
    """Gradient ∇f by 3×3 Sobel, which multiplies a slope by 8 (eq. 2): x and y, each (H, W)."""
    gx = cv2.Sobel(plane, cv2.CV_32F, 1, 0, ksize=3, borderType=cv2.BORDER_REPLICATE)
    gy = cv2.Sobel(plane, cv2.CV_32F, 0, 1, ksize=3, borderType=cv2.BORDER_REPLICATE)
    return as_plane(gx), as_plane(gy)


def gradient_magnitude(brightness: Plane, sigma: tuple[float, float]) -> Plane:
    """‖∇f‖ of a picture's edges (eq. 1), (H, W): what eq. 2 compares with ε."""
    return magnitude(*gradient(difference_of_gaussians(brightness, sigma)))


def kappa(shape: tuple[int, int], box: Box, buoyancy: tuple[float, float], n: float) -> Plane:
    """κ of each pixel (eq. 2): how far along the buoyancy it lies, 0..1, to the power n.

    For fire that rises this is the paper's ((bottom − y)/(bottom − top))^n; for a fireball that
    trails sideways it runs along the trail.

    Args:
        shape: (H, W).
        box: What κ spans: the image (as in the paper) or the flame's box. Pixels outside have the
            κ of its border.
        buoyancy: F_buoyancy, a unit vector in image axes: (0, −1) is up.
        n: Exponent; 0 gives 1 everywhere.

    Returns:
        (H, W) float32 in 0..1.
    """
    corners = [
        x * buoyancy[0] + y * buoyancy[1]
        for x in (box.left, box.right)
        for y in (box.top, box.bottom)
    ]
    start, end = min(corners), max(corners)
    y, x = np.ogrid[: shape[0], : shape[1]]
    # Straight up, all of a row have one κ.
    along = y * buoyancy[1] + (x * buoyancy[0] if buoyancy[0] else 0.0)
    share = np.clip((along - start) / max(end - start, 1.0), 0.0, 1.0)
    return np.broadcast_to(as_plane(share**n), shape).copy()


def feature_vectors(
    brightness: Plane,
    sigma: tuple[float, float],
    epsilon: float,
    kappa: Plane,
) -> tuple[Plane, Plane]:
    """Return Fv = ∇f κ where ‖∇f‖ > ε, else 0 (eq. 2): x and y, each (H, W)."""
    gx, gy = gradient(difference_of_gaussians(brightness, sigma))
    weight = kappa * (magnitude(gx, gy) > epsilon)
    return gx * weight, gy * weight


def refine(
    fx: Plane, fy: Plane, buoyancy: tuple[float, float], beta: float, clamp: float = 0.0
) -> tuple[Plane, Plane]:
    """Refined feature vectors Fv* = F_buoyancy ‖∇f κ‖ β + ∇f κ (eq. 3), then the clamp.

    Args:
        fx, fy: Fv of ``feature_vectors``.
        buoyancy: F_buoyancy, a direction in image axes: (0, −1) is up.
        beta: β.
        clamp: Vectors shorter than this become 0 (the paper's Figure 23; 0 keeps all).
    """
    length = magnitude(fx, fy)
    rx = fx + length * np.float32(buoyancy[0] * beta)
    ry = fy + length * np.float32(buoyancy[1] * beta)
    if clamp > 0:
        kept = magnitude(rx, ry) >= clamp
        rx, ry = rx * kept, ry * kept
    return rx, ry


def _gaussian(plane: Plane, sigma: float) -> Plane:
    size = 2 * math.ceil(3 * sigma) + 1
    return as_plane(cv2.GaussianBlur(plane, (size, size), sigma, borderType=cv2.BORDER_REPLICATE))
