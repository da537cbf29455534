"""Artificial motion blur of the flame layer along the buoyancy field (Kim & Lee, eq. 14-17)."""

import cv2
import numpy as np

from fire_atlas.core.pixels import Pixels, Plane, as_plane, magnitude
from fire_atlas.vision.warp import between_copies, sample_at

_LONGEST = 0.25
"""Maximum length of a path, relative to the frame's shorter side. A single fast cell of the field
would else mix into a pixel what lies all over the frame."""

_BATCH = 1 << 14
"""Maximum number of places sampled per call: OpenCV's pictures have at most 32,767 rows."""


def blur_along(
    pixels: Pixels,
    u: Plane,
    v: Plane,
    cell: int,
    kappa: Plane,
    exposure: float,
    samples: int,
    *,
    tiles: bool = False,
) -> Pixels:
    """Average each pixel along the path it travels while the shutter is open (eq. 17).

    The path is velocity · height weight · time, x_A(δ) = x(tⁿ) + (δ − tⁿ) Bv κ, at most a quarter
    of the frame long. Samples are spread evenly over the exposure, which is centred on the frame,
    so that nothing shifts (the paper's begins at the frame). The total light (and coverage) of the
    picture is kept.

    Args:
        pixels: The flame layer.
        u, v: (rows, columns) velocity of the buoyancy field [Bv] at the centre of each cell, px/s.
        cell: Side of a cell, px; the last row and column may extend beyond the frame.
        kappa: (H, W) height weight [κ], from 0 at the bottom of the flame to 1 at its top.
        exposure: Time the shutter is open, s.
        samples: Minimum number of samples along a path, at least 1. A path of more px has one for
            every px, so that what it passes is smeared rather than stamped.
        tiles: Whether what leaves the picture at one side enters at the other.
    """
    height, width = pixels.shape[:2]
    duration = kappa * np.float32(exposure)
    margin, first = 1 if tiles else 0, (1 - cell) / 2
    centres = np.array([[1, 0, first + margin * cell], [0, 1, first]]) / cell
    path_x, path_y = (
        duration * cv2.warpAffine(
            between_copies(plane, margin), centres, (width, height),
            borderMode=cv2.BORDER_REPLICATE, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
        for plane in (u, v)
    )  # fmt: skip
    path_x, path_y = bounded(path_x, path_y, (width, height))
    length = magnitude(path_x, path_y)
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    blurred = _mean_along(pixels, x, y, path_x, path_y, samples, tiles)
    while (long := np.flatnonzero(length > samples)).size:
        samples *= 2
        for start in range(0, len(long), _BATCH):
            places = long[start : start + _BATCH]
            at_x, at_y, to_x, to_y = (
                as_plane(plane.ravel()[places, None]) for plane in (x, y, path_x, path_y)
            )
            mean = _mean_along(pixels, at_x, at_y, to_x, to_y, samples, tiles)
            blurred.reshape(-1, 4)[places] = mean[:, 0]
    return _with_light_of(pixels, blurred)


def bounded(path_x: Plane, path_y: Plane, size: tuple[int, int]) -> tuple[Plane, Plane]:
    """Shorten paths, px, that are longer than a quarter of a frame of ``size`` (width, height)."""
    longest = np.float32(_LONGEST * min(size))
    shorter = longest / np.maximum(magnitude(path_x, path_y), longest)
    return as_plane(path_x * shorter), as_plane(path_y * shorter)


def _mean_along(
    pixels: Pixels, x: Plane, y: Plane, path_x: Plane, path_y: Plane, samples: int, tiles: bool
) -> Pixels:
    """Mean of samples along paths through the places (x, y), px, all (rows, columns)."""
    total = np.zeros((*x.shape, 4), np.float32)
    for moment in ((np.arange(samples) + 0.5) / samples - 0.5).astype(np.float32):
        moved = sample_at(pixels, x - path_x * moment, y - path_y * moment, tiles=tiles)
        cv2.add(total, moved, dst=total)
    return as_plane(total / np.float32(samples))


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
