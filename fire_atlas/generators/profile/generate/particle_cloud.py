"""Draw the particles of a fire alone, as the paper does: soft billboards in the table's colours
(Lee et al., III-C, Figures 14-15)."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.camera import Camera
from fire_atlas.core.easing import smooth_step
from fire_atlas.core.pixels import Pixels, as_plane
from fire_atlas.generators.profile.generate.axis import BentAxis
from fire_atlas.generators.profile.generate.colouring import TableColours, sample_table
from fire_atlas.generators.profile.generate.generated_fire import GeneratedFire
from fire_atlas.generators.profile.generate.particles import DRAWN_UP_TO, height_after
from fire_atlas.generators.profile.generate.skeleton import Skeleton
from fire_atlas.generators.profile.model import Profile

_BILLBOARD = 0.1
"""Standard deviation of a particle's billboard, half widths of the foot."""

_CUT_OFF = np.float32(4.0)
"""Distance at which a billboard ends, standard deviations."""

_VISIBLE = 5.0
"""Room around the places of particles, standard deviations of a billboard: as far as one is visible
where they are densest, and as a foot reaches below the base."""

_SMALLEST = 0.7
"""Smallest standard deviation of a billboard, px."""

_DENSITY = 4.0
"""Optical density of a flame filled evenly with its particles."""

_INSET = 0.5
"""Distance of the outermost paths from the outline, standard deviations of a billboard."""

_BEGIN, _FADING = 0.03, 0.75
"""Share of the way to the top at which particles have faded in, and at which they begin to fade."""

_OUTWARD = 2.0
"""Distance by which the outermost particles take their colours from further out in the table,
standard deviations of a billboard: overlapping billboards shift colours outwards, by as much at any
height, and the flame is narrower towards its top."""

_OUTLINE = 0.7
"""Distance of the flame's outline from the outermost particles, standard deviations of a
billboard."""

_TALLER = 1.2
"""Height in the table of coverage, relative to that of the particle in the flame."""

_FULL = 0.3
"""Coverage of a cell from which its particles are whole: the flame's outline, which leaves a part
of a cell empty, is that of the particles, and is not drawn once more by their opacity."""

_SHARP = 1.0
"""Standard deviation of a billboard that needs all pixels, px."""

_FULLNESS = 1.3
"""Area of a flame, relative to half the width of its foot times its height."""

_TAPER_HEIGHTS = np.linspace(0.1, 0.9, 9)
"""Heights at which the paths are fitted to the width of the flame, flame heights."""


def fitted_taper(profile: Profile) -> NDArray[np.float64]:
    """Return the coefficients (2,) of ``taper_curve`` that fit the mean width of the clip's flame
    best: the mean coverage of its cells, row by row."""
    grid, shades = profile.grid, profile.front.detail.shades[..., 3].astype(np.float64) / 255
    coverage = shades.mean(axis=0).sum(axis=1) / grid.cells_per_half / 2
    widths = np.interp(_TAPER_HEIGHTS, grid.heights[::-1], coverage[::-1])
    s = _TAPER_HEIGHTS
    base = max(float(widths[0]), 0.1)
    basis = np.stack([(1 - s) * s, (1 - s) * s * s], axis=1)
    found = np.linalg.lstsq(basis, widths / base - (1 - s), rcond=None)[0]
    return np.asarray(found, np.float64)


def billboard_margin(half_width: float) -> float:
    """Return how far billboards reach beyond the places of their particles in a fire whose foot has
    a ``half_width``, flame heights."""
    return _VISIBLE * _BILLBOARD * half_width


@dataclass(frozen=True, slots=True)
class ParticleCloud:
    """The particles of a fire seen by one camera.

    Attributes:
        fire: The fire.
        camera: The camera; its unit of length is the flame height.
        colours: Colours by place.
        taper: (2,) shape of the paths.
    """

    fire: GeneratedFire
    camera: Camera
    colours: TableColours
    taper: NDArray[np.float64]

    def places(
        self, skeleton: Skeleton, time: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the particles drawn at a ``time`` in frames: their places (n, 2), flame heights to
        the right of the axis and above the base; the share (n,) of their way to the top; where
        (n,) each is across the flame, -1 at its left edge to 1 at its right; and their sizes (n,).
        """
        particles, speed = self.fire.particles, self.fire.profile.rise_speed
        alive, age = particles.alive(time)
        share = height_after(age / self.fire.settings.fps, speed)
        drawn = np.flatnonzero(share < DRAWN_UP_TO)
        alive, share = alive[drawn], share[drawn]
        cos, sin = math.cos(self.camera.azimuth), math.sin(self.camera.azimuth)
        across = particles.x[alive] * cos + particles.z[alive] * sin
        across = np.clip(across / self.fire.base_curve.half_width(self.camera.azimuth), -1, 1)
        places = skeleton.paths(across * (1 - _INSET * _BILLBOARD), share, self.taper)
        return places, share, across, particles.size[alive]

    def picture(self, skeleton: Skeleton, axis: BentAxis, time: float) -> Pixels:
        """Draw the particles at a ``time`` in frames, along the ``axis`` of the fire: (height,
        width, 4)."""
        camera, foot = self.camera, skeleton.foot[1]
        places, share, across, size = self.places(skeleton, time)
        # Soft billboards are drawn smaller, and enlarged.
        factor = max(1, int(_BILLBOARD * foot * camera.scale / _SHARP))
        scale = camera.scale / factor
        height, width = -(-camera.height // factor), -(-camera.width // factor)
        sigma = np.maximum(_BILLBOARD * foot * size * scale, _SMALLEST)
        to_right, up = axis.placed(places[:, 1], places[:, 0])
        x = camera.origin[0] / factor + to_right * scale
        y = camera.origin[1] / factor - up * scale
        weight = smooth_step(share / _BEGIN) * smooth_step(
            (DRAWN_UP_TO - share) / (DRAWN_UP_TO - _FADING)
        )
        colours, coverage = self._colours(places, across * _BILLBOARD * foot, _BILLBOARD * foot)
        down = _gaussians(np.arange(height) + 0.5, y, sigma) * as_plane(weight)[:, None]
        right = _gaussians(np.arange(width) + 0.5, x, sigma)
        painted = (
            np.concatenate([colours, np.ones_like(coverage)[:, None]], axis=1) * coverage[:, None]
        )
        layers = [(down * as_plane(channel)[:, None]).T @ right for channel in painted.T]
        density = down.T @ right
        area = _FULLNESS * foot * skeleton.height * scale**2
        filled = float((weight * sigma * sigma).sum()) * 2 * math.pi / area
        alpha = 1 - np.exp(density * np.float32(-_DENSITY / max(filled, 1e-6)))
        drawn = (
            np.stack(layers, axis=-1) * (alpha / np.maximum(density, np.float32(1e-12)))[..., None]
        )
        enlarged = cv2.resize(as_plane(drawn), (width * factor, height * factor))
        return as_plane(enlarged[: camera.height, : camera.width])

    def _colours(
        self, places: NDArray[np.float64], outwards: NDArray[np.float64], sigma: float
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the linear colour (n, 3) of each particle, that of its cell, and its coverage.

        Args:
            places: (n, 2) as from ``places``.
            outwards: (n,) part of ``sigma`` that each is across the flame, to the right.
            sigma: Standard deviation of a billboard, flame heights.
        """
        low, high = places.min(axis=0), places.max(axis=0)
        margin = np.array([_OUTLINE * sigma, 0.0])
        shown = places + np.stack([_OUTWARD * outwards, np.zeros_like(outwards)], axis=1)
        across, up = ((shown - low + margin) / np.maximum(high - low + 2 * margin, 1e-6)).T
        x, y = across[None], 1 - up[None]
        # Coverage is stretched in height, or the lower outline would fade.
        stretched = 0.5 + (0.5 - up[None]) * _TALLER
        filled = sample_table(self.colours.coverage, x, stretched)[0] / np.float32(_FULL)
        gain = sample_table(self.colours.coverage_gain, x, stretched)[0]
        return self.colours.current.at(x, y)[0], np.clip(np.minimum(filled, 1) * gain, 0, 1)


def _gaussians(
    at: NDArray[np.floating], middle: NDArray[np.floating], sigma: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Return Gaussians (n, len(at)) about each ``middle`` (n,), sampled at the points ``at``; they
    end at ``_CUT_OFF``."""
    distance = as_plane((at - middle[:, None]) / sigma[:, None])
    # Tails so small that they are denormal would slow the sums down many times.
    return as_plane(np.where(np.abs(distance) < _CUT_OFF, np.exp(-0.5 * distance * distance), 0))
