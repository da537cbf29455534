"""Rasterise textured triangles and blend their light, in numpy, without a GPU.

Each triangle is split into row spans, all spans into one flat array of fragments, and each fragment
samples the texture, so a few array operations draw the whole mesh.
"""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Window
from fire_atlas.core.easing import saturated
from fire_atlas.core.pixels import as_plane
from fire_atlas.vision.warp import sample_at

_BLOCK = 1 << 15
"""Fragments that are computed at a time: a processor's cache holds them."""

_MAP_WIDTH = 4096
"""Fragments per row of the maps given to OpenCV, which limits the sides of its images."""


@dataclass(frozen=True, slots=True)
class Triangles:
    """n triangles.

    Attributes:
        position: (n, 3, 2) of their corners, px of the target, x right, y down.
        attributes: (n, 3, k) values at the corners, to be interpolated: first the texture's x and
            y, px from the middle of its first texel; then any others.
    """

    position: NDArray[np.float64]
    attributes: NDArray[np.float64]


def mesh_triangles(position: NDArray[np.float64], attributes: NDArray[np.float64]) -> Triangles:
    """Return two triangles for each cell of the meshes of sheets.

    Args:
        position: (sheets, rows, columns, 2) positions of the nodes, px.
        attributes: (sheets, rows, columns, k) values at the nodes.
    """

    def corners(nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        a, b = nodes[:, :-1, :-1], nodes[:, :-1, 1:]
        c, d = nodes[:, 1:, :-1], nodes[:, 1:, 1:]
        both = np.stack([np.stack([a, b, c], axis=3), np.stack([b, d, c], axis=3)], axis=3)
        return both.reshape(-1, 3, nodes.shape[-1])

    return Triangles(corners(position), corners(attributes))


@dataclass(frozen=True, slots=True)
class Fragments:
    """Pixels covered by triangles: one entry for each pixel middle in each triangle.

    Attributes:
        pixel: (n,) index of the pixel in the window, row by row.
        attributes: (n, k) float32, interpolated from the triangle's corners.
    """

    pixel: NDArray[np.intp]
    attributes: NDArray[np.float32]


def rasterise(triangles: Triangles, window: Window, *, tiles: bool = False) -> Fragments:
    """Find every pixel in a ``window`` of the target whose middle lies in a triangle.

    A middle on an edge that two triangles share belongs to exactly one of them. What lies beyond a
    side of a target that ``tiles``, of which the window has all columns, is found at the other.
    """
    width = window.right - window.left
    order = np.argsort(triangles.position[:, :, 1], axis=1, kind="stable")[..., None]
    corner = np.take_along_axis(triangles.position, order, axis=1)
    value = np.take_along_axis(triangles.attributes, order, axis=1)
    first, last = (
        np.clip(np.ceil(corner[:, k, 1] - 0.5), window.top, window.bottom).astype(np.intp)
        for k in (0, 2)
    )
    twice_area = _twice_the_area(corner)
    seen = (np.abs(twice_area) > 1e-9) & (last > first)
    corner, value, first, last = corner[seen], value[seen], first[seen], last[seen]
    dx, dy = _slopes(corner, value, twice_area[seen])

    # One span of columns for each row of each triangle.
    owner, row = _runs(first, last - first)
    at = row.astype(np.float64) + 0.5
    long, short = _crossings(corner, owner, at)
    sides = (-np.inf, np.inf) if tiles else (window.left, window.right)
    left = np.clip(np.ceil(np.minimum(long, short) - 0.5), *sides).astype(np.intp)
    right = np.clip(np.ceil(np.maximum(long, short) - 0.5), *sides).astype(np.intp)
    filled = right > left
    owner, row, left, right = (values[filled] for values in (owner, row, left, right))
    at = at[filled]

    # Attributes are linear over a triangle: begin with their values at the span's left end and add
    # their slope along the row. One attribute at a time, because numpy is slow along a short axis.
    over, down = left + 0.5 - corner[owner, 0, 0], at - corner[owner, 0, 1]
    begin, slope = np.empty((2, value.shape[2], len(owner)), np.float32)
    for k in range(value.shape[2]):
        slope[k] = rise = dx[:, k][owner]
        begin[k] = value[:, 0, k][owner] + rise * over + dy[:, k][owner] * down
    count = right - left
    begins = (row - window.top) * width - window.left
    end = np.cumsum(count)
    total = int(end[-1]) if len(end) else 0
    pixel, attributes = np.empty(total, np.intp), np.empty((value.shape[2], total), np.float32)
    cuts = np.searchsorted(end, np.arange(_BLOCK, total + _BLOCK, _BLOCK)) + 1
    start = 0
    for spans in (slice(*pair) for pair in pairwise([0, *cuts])):
        of = count[spans]
        step = _steps(of)
        here = slice(start, start := start + len(step))
        column = np.repeat(left[spans], of) + step
        pixel[here] = np.repeat(begins[spans], of) + (column % width if tiles else column)
        along = step.astype(np.float32)
        for k, attribute in enumerate(attributes[:, here]):
            np.multiply(np.repeat(slope[k, spans], of), along, out=attribute)
            attribute += np.repeat(begin[k, spans], of)
    return Fragments(pixel, attributes.T)


def _runs(
    first: NDArray[np.intp], count: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Concatenate runs of ``count`` integers from ``first``; return run index and value of each."""
    return np.repeat(np.arange(len(first)), count), np.repeat(first, count) + _steps(count)


def _steps(count: NDArray[np.intp]) -> NDArray[np.intp]:
    """Concatenate runs of ``count`` integers from 0."""
    end = np.cumsum(count)
    return np.arange(end[-1] if len(end) else 0) - np.repeat(end - count, count)


def _crossings(
    corner: NDArray[np.float64], owner: NDArray[np.intp], at: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x (n,) where rows at the heights ``at`` enter and leave triangles: on the edge from
    the top corner to the bottom one, and on the two others.

    Args:
        corner: (triangles, 3, 2) corners from top to bottom, px.
        owner: (n,) index of each row's triangle.
        at: (n,) px.
    """
    x, y = corner[..., 0], corner[..., 1]

    def crossing(upper: int, lower: int) -> NDArray[np.float64]:
        fall = y[:, lower] - y[:, upper]
        slope = (x[:, lower] - x[:, upper]) / np.where(fall > 0, fall, 1.0)
        return np.asarray(x[:, upper][owner] + (at - y[:, upper][owner]) * slope[owner])

    is_lower = at >= y[:, 1][owner]
    return crossing(0, 2), np.where(is_lower, crossing(1, 2), crossing(0, 1))


def _twice_the_area(corner: NDArray[np.float64]) -> NDArray[np.float64]:
    one, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    return np.asarray(one[:, 0] * other[:, 1] - other[:, 0] * one[:, 1])


def _slopes(
    corner: NDArray[np.float64], value: NDArray[np.float64], twice_area: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes (triangles, k) of the attributes per px right and per px down."""
    one, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    change, other_change = value[:, 1] - value[:, 0], value[:, 2] - value[:, 0]
    dx = change * other[:, 1:] - other_change * one[:, 1:]
    dy = other_change * one[:, :1] - change * other[:, :1]
    return dx / twice_area[:, None], dy / twice_area[:, None]


def sample_texture(
    texture: NDArray[np.float32], position: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Sample a texture (h, w, c) bilinearly at x and y (n, 2 or more): (n, c); 0 outside."""
    count = len(position)
    if not count:
        return np.zeros((0, texture.shape[2]), np.float32)
    rows = -(-count // _MAP_WIDTH)
    # Separate maps for x and y, because OpenCV rounds maps of (x, y) pairs to 1/32 px.
    maps = np.full((2, rows * _MAP_WIDTH), -2.0, np.float32)
    maps[:, :count] = position[:, :2].T
    x, y = maps.reshape(2, rows, _MAP_WIDTH)
    found = sample_at(texture, x, y, border=cv2.BORDER_CONSTANT)
    return np.asarray(found, np.float32).reshape(rows * _MAP_WIDTH, -1)[:count]


def accumulate(
    pixel: NDArray[np.intp], light: NDArray[np.float32], window: Window
) -> NDArray[np.float32]:
    """Return the sum of ``light`` (c, n) on each pixel of a window: (height, width, c)."""
    height, width = window.bottom - window.top, window.right - window.left
    target = np.empty((height * width, len(light)), np.float32)
    for c, channel in enumerate(light):
        target[:, c] = np.bincount(pixel, weights=channel, minlength=height * width)
    return target.reshape(height, width, -1)


_MIN_SPREAD = 0.004
"""Standard deviation of the depth of what is on a sheet, heights: sheets that cross blend over
about this distance."""

_LOGISTIC = np.float32(1.7)
"""The logistic function of 1.7 x is within 0.01 of the normal distribution."""

_QUANTILES, _WEIGHTS = np.polynomial.legendre.leggauss(3)[0] / 2 + 0.5, (5 / 18, 8 / 18, 5 / 18)
"""Quantiles of that depth, and their weights, for a mean over it (Gauss-Legendre)."""


class Medium:
    """Translucent matter in front of each pixel, kept as moments of its depth.

    Moments need no sorting and change smoothly with time, also where sheets cross (moment-based
    order-independent transparency, Münstermann et al. 2018, here with two moments).
    """

    def __init__(self, pixels: int) -> None:
        """Prepare for a target of so many pixels, with nothing in front of them."""
        self._moments = np.zeros((3, pixels))

    @property
    def thickness(self) -> NDArray[np.float64]:
        """Optical depth of all matter in front of each pixel, (pixels,)."""
        return np.asarray(self._moments[0])

    def add(
        self, pixel: NDArray[np.intp], depth: NDArray[np.float32], thickness: NDArray[np.float32]
    ) -> None:
        """Add matter of an optical depth ``thickness`` at ``depth``, (n,) each."""
        weight = thickness.astype(np.float64)
        for moment in self._moments:
            moment += np.bincount(pixel, weights=weight, minlength=len(moment))
            weight = weight * depth

    def before(self) -> "MatterBefore":
        """Return what light passes on its way out of the matter added so far."""
        total, first, second = self._moments
        mean = first / np.maximum(total, 1e-12)
        variance = np.maximum(second / np.maximum(total, 1e-12) - mean * mean, 0.0)
        spread = np.sqrt(variance + _MIN_SPREAD**2)
        return MatterBefore(as_plane(total), as_plane(mean), as_plane(1 / spread))


@dataclass(frozen=True, slots=True)
class MatterBefore:
    """Translucent matter in front of each pixel, (pixels,) each.

    Attributes:
        thickness: Its optical depth.
        mean: Its mean depth, heights.
        sharpness: 1 by the standard deviation of its depth, 1/heights.
    """

    thickness: NDArray[np.float32]
    mean: NDArray[np.float32]
    sharpness: NDArray[np.float32]

    def let_through(
        self,
        light: NDArray[np.float32],
        pixel: NDArray[np.intp],
        depth: NDArray[np.float32],
        thickness: NDArray[np.float32],
        dimming: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """Return the part of light (channels, n), shed at ``depth``, that passes what is in front.

        It is the mean over the depths that the matter added there itself may have, of optical depth
        ``thickness`` (n,). That matter hides nothing of its own light: it would let a part of
        (1 − e⁻ᵗ) / t pass, by which the mean is divided. Where n sheets coincide, each so passes
        the mean over all their orders: within .02 up to an optical depth of 10 in all, and less
        from there on.

        Args:
            light: (channels, n).
            pixel: (n,) index of each light's pixel.
            depth, thickness: (n,).
            dimming: (channels, n), or (channels, 1) for all, how much an optical depth dims each
                channel.
        """
        passed = np.empty_like(light)
        for first in range(0, len(pixel), _BLOCK):
            part = slice(first, first + _BLOCK)
            at = pixel[part]
            sharpness, matter = self.sharpness[at], self.thickness[at]
            place = (self.mean[at] - depth[part]) * (_LOGISTIC * sharpness)
            step = np.float32(_MIN_SPREAD) * sharpness
            nearer = [
                matter / (1 + np.exp(np.clip(place - np.float32(logit) * step, -30, 30)))
                for logit in np.log(_QUANTILES / (1 - _QUANTILES))
            ]
            own = np.maximum(thickness[part], np.float32(1e-6))
            for c, channel in enumerate(dimming[:, part] if dimming.shape[1] > 1 else dimming):
                share = np.zeros_like(place)
                for optical_depth, weight in zip(nearer, _WEIGHTS, strict=True):
                    share += np.float32(weight) * np.exp(-channel * optical_depth)
                share *= channel * own / saturated(channel * own)
                np.multiply(light[c, part], np.minimum(share, 1), out=passed[c, part])
        return passed
