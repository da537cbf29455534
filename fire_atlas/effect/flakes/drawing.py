"""Drawing flakes: additive, sub-pixel, in linear light that may exceed 1."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import as_plane
from fire_atlas.effect.flakes.coverage import LARGE, Ellipses, Spans, alike
from fire_atlas.effect.flakes.tracks import COLUMNS

_FLAKES, _SPANS = 1 << 18, 1 << 15
"""Area, px, of the flakes that are drawn together, and of their spans that are: little enough for
the processor's cache, and enough of one size to be worth a call."""

_HALO = 0.018
"""Width (σ) of a halo, heights."""

_SMALLEST = 2.6
"""Width, px, of the smallest soft sprite that a pixel grid still shows without flicker."""


def drawn_width(width: NDArray[np.float64], hard: bool) -> NDArray[np.float64]:
    """Width, px, at which sprites of a ``width`` are drawn: ``hard`` ones as one or two pixels."""
    return np.clip(np.rint(width), 1, 2) if hard else np.maximum(width, _SMALLEST)


def draw_flakes(rows: NDArray[np.float64], height: int, width: int) -> NDArray[np.float32]:
    """Light (height, width, 3), linear, of one frame's flakes on black.

    Each row is a soft ellipse (1 − q²)² with q² = (2a/(size·stretch))² + (2b/size)², a along its
    rotation and b across; rgb·a is the light at its centre. Each ellipse gives exactly the light
    of its integral, however it falls on the pixels.

    Args:
        rows: (flakes, 14), columns ``tracks.COLUMNS``.
        height, width: Frame, px.
    """
    canvas = np.zeros((height, width, 3), np.float32)
    column = dict(zip(COLUMNS, rows.T, strict=True))
    across = column["size"] / 2
    along = across * column["stretch"]
    ellipses = Ellipses.of(
        column["x"], column["y"], along, across, column["rotation"], (height, width)
    )
    light = np.stack([column[name] for name in "rgb"]) * column["a"]
    wanted = along * across * (math.pi / 3)  # ∫(1 − q²)² over the ellipse
    for group in alike(ellipses.rows, ellipses.area, _FLAKES):
        spans = ellipses.spans(group)
        total = np.zeros(len(spans.length), np.float32)
        drawn = []
        for some in alike(spans.length, spans.length, _SPANS):
            weights = spans.weights(some)
            total[some] = weights.sum(axis=0)
            drawn.append((some, weights))
        total = total.reshape(-1, len(group)).sum(axis=0)
        # Pixels stand for large ellipses as they are, and these may reach out of the frame.
        exact = np.where(across[group] < LARGE, wanted[group] / np.maximum(total, 1e-12), 1.0)
        shine = as_plane(light[:, group] * exact)
        for some, weights in drawn:
            _add(canvas, spans, some, weights, shine)
    return canvas


def _add(
    canvas: NDArray[np.float32],
    spans: Spans,
    some: NDArray[np.intp],
    weights: NDArray[np.float32],
    light: NDArray[np.float32],
) -> None:
    """Add ``some`` spans to a canvas (H, W, 3): ``weights`` (pixels, spans) times ``light``
    (3, flakes); the weights of what falls outside become 0."""
    height, width = canvas.shape[:2]
    x, y, step = spans.x.take(some), spans.y.take(some), np.arange(len(weights))[:, None]
    pixel = y * width + x + step
    leaves = np.flatnonzero((x < 0) | (x + len(weights) > width) | (y < 0) | (y >= height))
    if leaves.size:
        x, y = x[leaves] + step, y[leaves]
        seen = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        weights[:, leaves] *= seen
        pixel[:, leaves] *= seen
    flake = some % light.shape[1]
    for plane, shine in zip(canvas.reshape(-1, 3).T, light, strict=True):
        if shine.any():  # most flakes have no blue
            np.add.at(plane, pixel.ravel(), (weights * shine.take(flake)).ravel())


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


def _ranges(
    first: NDArray[np.float64], last: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Every integer of the ranges first..last, and the index of the range each comes from."""
    count = np.maximum(last - first + 1, 0).astype(np.intp)
    owner = np.repeat(np.arange(len(count)), count)
    before = first.astype(np.intp) - (np.cumsum(count) - count)
    return owner, before[owner] + np.arange(len(owner))
