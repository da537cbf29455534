"""Colours of a flame: its hue, how grey it is, how few colours it has, and its own ramp.

Colours are those that are shown over black: sRGB in 0..1. A pixel counts by its light.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, as_plane, encode_bytes, encode_unit, srgb_to_hex
from fire_atlas.effect.flame.samples import FlameSamples

_WARM = (-20.0, 70.0)
"""Hues of fire, degrees: from a bluish red to a greenish yellow."""

_FREQUENT = 16
"""Number of a frame's most frequent colours that are counted together."""

_SOLID, _CLEAR = 247, 8
"""Coverage, 0..255, from which a pixel counts as opaque, and up to which as transparent."""

_RAMP = (0.05, 0.2, 0.35, 0.5)
"""Quantiles of the flame's area from dark to bright; between each two, one colour of its ramp."""

_DARK = 0.35
"""Colours with less than this part of the light of the brightest are no embers' but outlines'."""

_MAX_COLOURS = 4
"""Maximum number of colours of flakes that are taken from flat art."""


@dataclass(frozen=True, slots=True)
class FlameColours:
    """Figures about a flame's colours.

    Attributes:
        hue: Mean hue, degrees: 0 red, 60 yellow, 120 green, 240 blue.
        warmth: Share of the colourful light that has a hue of fire, 0..1.
        chroma: Mean of brightest minus dimmest channel, 0..1; 0 is grey.
        peak: Brightest channel of the flame's brightest pixels, 0..1.
        few: Share of a frame's opaque pixels that have one of its most frequent colours, 0..1.
        count: Number of different colours in a frame.
        soft: Share of a frame's visible pixels that are half transparent, 0..1.
    """

    hue: float
    warmth: float
    chroma: float
    peak: float
    few: float
    count: float
    soft: float

    @classmethod
    def of(cls, samples: FlameSamples) -> "FlameColours":
        """Measure the samples of a clip."""
        colour, weight = _flame_pixels(samples)
        brightest = colour.max(axis=0)
        chroma = brightest - colour.min(axis=0)
        angle = _hue(colour)
        vivid = weight * chroma
        total = max(float(vivid.sum()), 1e-9)
        is_warm = (angle > _WARM[0]) & (angle < _WARM[1])
        x, y = (vivid * np.cos(np.radians(angle))).sum(), (vivid * np.sin(np.radians(angle))).sum()
        bright = brightest[weight > 0.3]
        few, count, soft = np.median(
            [_counts(frame.colours) for frame in samples.frames.values()], 0
        )
        return cls(
            hue=math.degrees(math.atan2(y, x)) % 360,
            warmth=float(vivid[is_warm].sum()) / total,
            chroma=float(vivid.sum()) / max(float(weight.sum()), 1e-9),
            peak=float(np.quantile(bright, 0.99)) if bright.size else 0.0,
            few=float(few),
            count=float(count),
            soft=float(soft),
        )


def _flame_pixels(samples: FlameSamples) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the colours (3, n) of the flame's pixels and their weights (n,): light times flame."""
    frames = samples.frames.values()
    light = np.concatenate([frame.pixels.reshape(-1, 4) for frame in frames])
    weight = np.concatenate([(frame.flame * frame.brightness).ravel() for frame in frames])
    flame = np.flatnonzero(weight)
    colour = encode_unit(np.ascontiguousarray(light[flame].T[:3]))
    return colour, as_plane(weight[flame] / np.float32(255))


def _hue(colour: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the hues of colours (3, n), degrees in -180..180."""
    red, green, blue = colour
    return as_plane(np.degrees(np.arctan2(math.sqrt(3) * (green - blue), 2 * red - green - blue)))


def _codes(colours: Bytes) -> NDArray[np.int64]:
    """Return 0xRRGGBB of the opaque pixels among (rows, w, 4)."""
    solid = colours[colours[..., 3] > 127].astype(np.int64)
    return np.asarray(solid[:, 0] << 16 | solid[:, 1] << 8 | solid[:, 2], np.int64)


def _counts(colours: Bytes) -> tuple[float, float, float]:
    """Return ``few``, ``count`` and ``soft`` of a frame's pixels (rows, w, 4)."""
    counts = np.sort(np.unique(_codes(colours), return_counts=True)[1])[::-1]
    coverage = colours[..., 3]
    visible = int(np.count_nonzero(coverage > _CLEAR))
    soft = int(np.count_nonzero((coverage > _CLEAR) & (coverage < _SOLID)))
    few = float(counts[:_FREQUENT].sum()) / max(float(counts.sum()), 1.0)
    return few, float(len(counts)), soft / max(float(visible), 1.0)


def colour_ramp(samples: FlameSamples) -> tuple[str, ...]:
    """Return the colours of light of a flame's dimmer parts, from dark to bright, as hex.

    They are as bright as their hue allows: flakes are as bright as they are hot, and film shows
    the hot ones as pale as the flame's core.
    """
    frames = samples.frames.values()
    light = np.concatenate([frame.pixels[..., :3].reshape(-1, 3) for frame in frames])
    flame = np.concatenate([frame.flame.ravel() for frame in frames])
    brightest = light.max(axis=1)
    order = np.argsort(brightest, kind="stable")
    total = np.cumsum(flame[order], dtype=np.float64)
    edges = np.searchsorted(total, total[-1] * np.array(_RAMP))
    ramp = []
    for first, last in pairwise(edges):
        band = order[first : last + 1]
        mean = (light[band] * flame[band, None]).sum(axis=0, dtype=np.float64)
        ramp.append(srgb_to_hex(encode_bytes(as_plane(mean / max(mean.max(), 1e-9))[None])[0]))
    return tuple(ramp)


def flat_colours(samples: FlameSamples) -> tuple[str, ...]:
    """Return the most frequent colours of art that has few, from dark to bright, as hex.

    The brightest of them is left out: it is the core's, which is hotter than any ember.
    """
    codes = np.concatenate([_codes(frame.colours) for frame in samples.frames.values()])
    values, counts = np.unique(codes, return_counts=True)
    colours = np.stack([values >> 16, values >> 8 & 255, values & 255], axis=1)
    light = colours.max(axis=1) + colours.mean(axis=1)
    bright = np.flatnonzero(light >= _DARK * light.max())
    frequent = bright[np.argsort(-counts[bright], kind="stable")][:_MAX_COLOURS]
    ordered = frequent[np.argsort(light[frequent], kind="stable")]
    embers = ordered[: max(1, len(ordered) - 1)]
    return tuple(srgb_to_hex(colour) for colour in colours[embers].astype(np.uint8))
