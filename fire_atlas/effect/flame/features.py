"""Feature vectors (Kim & Lee, eq. 1-3): strength and direction of the flame's edges.

Sparks are spawned on these edges. Brightness is on the 0..255 scale, and Sobel's filters scale its
slopes by 8: the paper says neither scale. Image axes: x right, y down.
"""

import math
from typing import Literal, NamedTuple

import cv2
import numpy as np

from fire_atlas.core.pixels import Plane, as_plane, magnitude

Kernel = Literal["unit", "printed"]
"""The Gaussians of eq. 1: with sums of 1, or as printed."""


class Box(NamedTuple):
    """A box in a frame: its first and last columns and rows, px."""

    left: float
    top: float
    right: float
    bottom: float


def difference_of_gaussians(brightness: Plane, sigma: tuple[float, float], kernel: Kernel) -> Plane:
    """Edges f^DoG of a picture (eq. 1).

    ``printed``: G_σ1 − G_σ2 with the paper's prefactors 1/(√(2π) σ), so that the Gaussian of σ sums
    to √(2π) σ. The difference sums to √(2π) (σ1 − σ2), which is negative: f is mainly the picture's
    negative, and ∇f, all that is used of f, points from bright to dark, out of the flame: up at its
    tips, and down at its foot, which κ suppresses (Figure 8).

    ``unit``: Gaussians of sum 1, so that f is 0 but at edges. The sign is swapped (G_σ2 − G_σ1), so
    that ∇f points out of the flame as well on the inner side of an edge; on the outer side it
    points back.

    Args:
        brightness: (H, W), 0..255.
        sigma: (σ1, σ2), px, σ1 <= σ2.
        kernel: The Gaussians.

    Returns:
        (H, W).
    """
    narrow, wide = (_gaussian(brightness, deviation) for deviation in sigma)
    if kernel == "unit":
        return as_plane(cv2.subtract(wide, narrow, dst=wide))
    gain = [math.sqrt(2 * math.pi) * deviation for deviation in sigma]
    return as_plane(cv2.addWeighted(narrow, gain[0], wide, -gain[1], 0.0))


def gradient(plane: Plane) -> tuple[Plane, Plane]:
    """Gradient ∇f (eq. 2) by 3×3 Sobel filters, which scale slopes by 8: x and y, each (H, W)."""
    gx = cv2.Sobel(plane, cv2.CV_32F, 1, 0, ksize=3, borderType=cv2.BORDER_REPLICATE)
    gy = cv2.Sobel(plane, cv2.CV_32F, 0, 1, ksize=3, borderType=cv2.BORDER_REPLICATE)
    return as_plane(gx), as_plane(gy)


def gradient_magnitude(brightness: Plane, sigma: tuple[float, float], kernel: Kernel) -> Plane:
    """Edge strength ‖∇f‖, (H, W), of a picture; eq. 2 compares it with ε."""
    return magnitude(*gradient(difference_of_gaussians(brightness, sigma, kernel)))


def kappa(shape: tuple[int, int], box: Box, buoyancy: tuple[float, float], n: float) -> Plane:
    """κ of each pixel (eq. 2): its position along the buoyancy, 0..1, to the power n.

    For rising fire this is the paper's ((bottom − y)/(bottom − top))^n; for a fireball that trails
    sideways κ grows along the trail.

    Args:
        shape: (H, W).
        box: Box over which κ goes from 0 to 1: the image (as in the paper) or the flame's box.
            Pixels outside have the κ of its border.
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
    # With vertical buoyancy κ is the same along a row, so the x term is skipped.
    along = y * buoyancy[1] + (x * buoyancy[0] if buoyancy[0] else 0.0)
    share = np.clip((along - start) / max(end - start, 1.0), 0.0, 1.0)
    return np.broadcast_to(as_plane(share**n), shape).copy()


def feature_vectors(
    brightness: Plane,
    sigma: tuple[float, float],
    kernel: Kernel,
    epsilon: float | np.float32 | Plane,
    kappa: Plane,
) -> tuple[Plane, Plane]:
    """Return Fv = ∇f κ where ‖∇f‖ > ε, else 0 (eq. 2): x and y, each (H, W).

    ``epsilon`` is a number or (H, W).
    """
    gx, gy = gradient(difference_of_gaussians(brightness, sigma, kernel))
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
        clamp: Vectors shorter than this become 0 (the paper's Figure 23); 0 keeps all.
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
