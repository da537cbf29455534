"""Drawing flakes: additive, sub-pixel, in linear light that may exceed 1."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane
from fire_atlas.flakes.tracks import COLUMNS

_LARGE = 8.0
"""Half width, px, from which pixel centres sample a sprite as well as its integral."""

_BATCH = 4_000_000
"""Pixels under the flakes that are drawn at a time."""

_HALO = 0.018
"""Width (σ) of a halo, heights."""

SMALLEST = 2.6
"""Width, px, of the smallest sprite that a pixel grid still shows without flicker."""


def draw_flakes(rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Light (height, width, 3), linear, of one frame's flakes on black.

    Each row is a soft ellipse (1 − q²)² with q² = (2a/(size·stretch))² + (2b/size)², a along its
    rotation and b across; rgb·a is the light at its centre. Each ellipse gives exactly the light
    of its integral, however it falls on the pixels.

    Args:
        rows: (flakes, 14), columns ``tracks.COLUMNS``.
        height, width: Frame, px.
    """
    light = np.zeros((height * width, 3), np.float32)
    if len(rows) == 0:
        return light.reshape(height, width, 3)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    across = column["size"] / 2
    along = across * column["stretch"]
    rgb = np.stack([column[name] for name in "rgb"]).astype(np.float32)
    for batch in _batches(np.minimum(4 * along * across, float(height * width))):
        flake, x, y, weight = _cover(
            column["x"][batch],
            column["y"][batch],
            along[batch],
            across[batch],
            column["rotation"][batch],
            height,
            width,
        )
        total = np.bincount(flake, weight, minlength=len(batch))
        wanted = along[batch] * across[batch] * (math.pi / 3)  # ∫(1 − q²)² over the ellipse
        # Pixels stand for large ellipses as they are, and these may reach out of the frame.
        exact = np.where(across[batch] < _LARGE, wanted / np.maximum(total, 1e-12), 1.0)
        weight *= (column["a"][batch] * exact).astype(np.float32)[flake]
        pixel = y * width + x
        seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        if not seen.all():
            flake, pixel, weight = flake[seen], pixel[seen], weight[seen]
        for c in range(3):
            np.add.at(light[:, c], pixel, weight * rgb[c, batch][flake])
    return light.reshape(height, width, 3)


def _batches(areas: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Indices of flakes, so many at a time that memory stays bounded."""
    part = (np.cumsum(areas) // _BATCH).astype(np.intp)
    return np.split(np.arange(len(areas)), np.flatnonzero(np.diff(part)) + 1)


def draw_pixels(rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Light (height, width, 3) of one frame's flakes as hard squares of ``size`` whole pixels.

    Where squares meet, the brighter channel shows: light does not add up to new colours.
    """
    light = np.zeros((height * width, 3), np.float32)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    side = column["size"].astype(np.intp)
    left = np.rint(column["x"] - side / 2)
    top = np.rint(column["y"] - side / 2)
    row_flake, row = _ranges(top, top + side - 1)
    span, x = _ranges(left[row_flake], (left + side - 1)[row_flake])
    flake, y = row_flake[span], row[span]
    seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    flake, pixel = flake[seen], (y[seen] * width + x[seen])
    for c, name in enumerate("rgb"):
        shine = (column[name] * column["a"]).astype(np.float32)
        np.maximum.at(light[:, c], pixel, shine[flake])
    return light.reshape(height, width, 3)


def add_halo(light: NDArray[np.float32], share: float, fades: bool) -> NDArray[np.float32]:
    """Flake layer (H, W, 3) with a soft halo of ``share`` times its light.

    One that ``fades`` is dark at the border of the frame.
    """
    height, width = light.shape[:2]
    sigma = _HALO * height
    halo = cv2.GaussianBlur(light, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
    if fades:
        down, across = (
            np.clip(np.minimum(np.arange(n), np.arange(n)[::-1]) / (2 * sigma), 0, 1)
            for n in (height, width)
        )
        halo = as_plane(halo * np.minimum.outer(down, across)[..., None])
    return as_plane(cv2.addWeighted(light, 1.0, halo, share, 0.0))


def _cover(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    along: NDArray[np.float64],
    across: NDArray[np.float64],
    rotation: NDArray[np.float64],
    height: int,
    width: int,
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    """Pixels under each ellipse: flake index, pixel x, pixel y, weight (1 − q²)².

    q² = p dx² + 2 r dx dy + s dy². Each row of an ellipse is a span found in closed form, so that
    only pixels under it are touched, and along it 1 − q² = depth − p (x − middle)².
    """
    cos, sin = np.cos(rotation), np.sin(rotation)
    p = (cos / along) ** 2 + (sin / across) ** 2
    s = (sin / along) ** 2 + (cos / across) ** 2
    r = cos * sin * (along**-2 - across**-2)
    reach = np.sqrt(p) * along * across  # p s − r² = 1/(along·across)²
    large = across >= _LARGE  # these are cut at the frame here, small ones once they are weighed
    row_flake, row = _ranges(
        *_held(np.ceil(y - 0.5 - reach), np.floor(y - 0.5 + reach), height, large)
    )
    dy = row + 0.5 - y[row_flake]
    p_row, r_row = p[row_flake], r[row_flake]
    middle = x[row_flake] - r_row * dy / p_row
    depth = np.maximum(1 - (s[row_flake] - r_row**2 / p_row) * dy**2, 0.0)
    half = np.sqrt(depth / p_row)
    span, column = _ranges(
        *_held(np.ceil(middle - 0.5 - half), np.floor(middle - 0.5 + half), width, large[row_flake])
    )
    # From the middle in whole pixels and a rest, so that single precision is exact enough.
    start = np.floor(middle)
    d = (column - start.astype(np.intp)[span]).astype(np.float32)
    d += (0.5 - (middle - start)).astype(np.float32)[span]
    d *= d
    d *= -p_row.astype(np.float32)[span]
    d += depth.astype(np.float32)[span]
    np.maximum(d, 0, out=d)
    d *= d
    return row_flake[span], column, row[span], d


def _held(
    first: NDArray[np.float64], last: NDArray[np.float64], end: int, large: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ranges first..last, those of ``large`` flakes held to 0..end − 1."""
    return (
        np.where(large, np.maximum(first, 0), first),
        np.where(large, np.minimum(last, end - 1), last),
    )


def _ranges(
    first: NDArray[np.float64], last: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Every integer of the ranges first..last, and the index of the range each comes from."""
    count = np.maximum(last - first + 1, 0).astype(np.intp)
    owner = np.repeat(np.arange(len(count)), count)
    before = first.astype(np.intp) - (np.cumsum(count) - count)
    return owner, before[owner] + np.arange(len(owner))
