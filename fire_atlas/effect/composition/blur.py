"""Artificial motion blur of the flame layer along the buoyancy field (Kim & Lee, eq. 14-17)."""

import cv2
import numpy as np

from fire_atlas.core.pixels import Pixels, Plane, as_plane
from fire_atlas.vision.warp import sample_at

EXAGGERATION = 8.0
"""Length of a flame's blur relative to the path eq. 17 gives: "we exaggerate the motion of the fire
effect" (section III-D). κ takes most of that path, and what is left can hardly be seen."""


def blur_along(
    pixels: Pixels,
    u: Plane,
    v: Plane,
    cell: int,
    kappa: Plane,
    exposure: float,
    samples: int,
) -> Pixels:
    """Average each pixel along the path it travels while the shutter is open (eq. 17).

    The path is velocity · height weight · time, x_A(δ) = x(tⁿ) + (δ − tⁿ) Bv κ. Samples are spread
    evenly over the exposure, which is centred on the frame, so that nothing shifts. The total light
    (and coverage) of the picture is kept.

    Args:
        pixels: The flame layer.
        u, v: (rows, columns) velocity of the buoyancy field [Bv] at the centre of each cell, px/s.
        cell: Side of a cell, px; the last row and column may extend beyond the frame.
        kappa: (H, W) height weight [κ], from 0 at the bottom of the flame to 1 at its top.
        exposure: Time the shutter is open, s.
        samples: Number of samples along the path, at least 1.
    """
    height, width = pixels.shape[:2]
    duration = kappa * np.float32(exposure)
    centres = np.array([[1, 0, (1 - cell) / 2], [0, 1, (1 - cell) / 2]]) / cell
    path_x, path_y = (
        duration * cv2.warpAffine(
            plane, centres, (width, height), borderMode=cv2.BORDER_REPLICATE,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
        for plane in (u, v)
    )  # fmt: skip
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    total = np.zeros_like(pixels)
    for moment in ((np.arange(samples) + 0.5) / samples - 0.5).astype(np.float32):
        moved = sample_at(pixels, x - path_x * moment, y - path_y * moment)
        cv2.add(total, moved, dst=total)
    return _with_light_of(pixels, total / np.float32(samples))


def _with_light_of(original: Pixels, blurred: Pixels) -> Pixels:
    """Scale each channel of ``blurred`` to the sum it has in ``original``, by 5 % at most.

    This corrects the error of sampling along a diverging field. The limit is there because light
    that was blurred out of the frame must not come back.
    """
    before = original.reshape(-1, 4).sum(axis=0, dtype=np.float64)
    after = blurred.reshape(-1, 4).sum(axis=0, dtype=np.float64)
    scale = np.divide(before, after, out=np.ones(4), where=after > 0)
    result = blurred * np.clip(scale, 0.95, 1.05).astype(np.float32)
    np.minimum(result[..., 3], 1.0, out=result[..., 3])
    return as_plane(result)
