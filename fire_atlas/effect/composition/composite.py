"""Composition: blend the flake layer with the flame layer, in linear light."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import (
    as_plane,
    decode_unit,
    encode_bytes,
    encode_unit,
    expose,
    srgb_to_linear,
    unpremultiply,
)
from fire_atlas.core.workers import Workers
from fire_atlas.vision.sampling import evenly_spread

_MIN_DIVISOR = np.float32(1e-6)
"""Minimum coverage that light is divided by."""

_WHITE = np.float32(254 / 255)
"""The most that film has shown of any light, linear."""

_MIN_VISIBLE = 0.25
"""Brightness (sRGB, 0..1) from which a flake is drawn in a colour of the palette. Dimmer ones are
left out: a palette of few colours cannot show them fade."""

VISIBLE_LIGHT = float(1 / (1 / srgb_to_linear(np.array(_MIN_VISIBLE)) - 1))
"""Light, before exposure, that is shown as bright as that."""

_PALETTE_SAMPLES = 16
"""Number of frames, evenly spread over the clip, in which its colours are counted."""

_PALETTE_SIZE = 512
"""Maximum number of colours kept, the most frequent ones; pixel art has fewer."""


def compose(
    under: NDArray[np.float32],
    flakes: NDArray[np.float32],
    blend: str,
    blend_space: str,
    palette: NDArray[np.float32] | None = None,
    dots: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """Blend flakes with the flame behind them, pixel by pixel: (4, pixels).

    ``add``: their light is added to the light that the film of the flame saw, then exposed again.
    ``screen``: 1 − (1 − flame)(1 − flakes), both exposed. ``over``: flakes hide the flame in
    proportion to their exposed light. That is what is seen over black. Coverage is raised so that
    flakes show on an empty background too: to their brightest channel, encoded in the client's
    blend space.

    Args:
        under: (4, pixels), the flame's premultiplied linear light and coverage.
        flakes: (3, pixels), light of the flake layer on black.
        blend: ``add``, ``screen`` or ``over``.
        blend_space: Where the client blends, which decides how much coverage light needs.
        palette: (colours, 3) sRGB in 0..1. If given, pixels whose flakes are bright enough to be
            seen take the nearest of these colours, fully opaque; all others stay as they are.
        dots: (pixels,), coverage of the dots as which flakes of a palette are painted, as from
            ``FlakeLight.dots``; None for pixel art, whose pixels are covered wholly or not at all.
    """
    if palette is not None and dots is not None:
        return _painted(under, flakes, palette, dots)
    brightest = expose(flakes.max(axis=0))
    shown = encode_unit(brightest)
    coverage, behind = under[3], under[:3]
    if blend_space == "srgb":
        behind = _as_seen(behind, coverage)
    light = _blended(behind, flakes, brightest, blend)
    pixels = np.empty_like(under)
    if blend_space == "srgb":
        needed = encode_unit(light.max(axis=0))
        pixels[3] = np.maximum(coverage + shown * (1 - coverage), needed)
        pixels[:3] = _to_be_seen(light, pixels[3])
    else:
        needed = np.minimum(light.max(axis=0), 1.0)
        pixels[3] = np.maximum(coverage + brightest * (1 - coverage), needed)
        pixels[:3] = light
    if palette is not None:
        pixels[:3] = _nearest_colours(pixels[:3], palette)
        pixels[3] = 1.0
        faint = shown < _MIN_VISIBLE
        pixels[:, faint] = under[:, faint]
    return pixels


def _painted(
    under: NDArray[np.float32],
    flakes: NDArray[np.float32],
    palette: NDArray[np.float32],
    dots: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Return the flame (4, pixels) with ``dots`` over it, each in one of the palette's colours.

    It is the nearest to the colour of the flakes (3, pixels) at full light, so that a dot is as
    bright at its edge as in its middle.
    """
    full = flakes / np.maximum(flakes.max(axis=0), _MIN_DIVISOR)
    over = np.vstack([_nearest_colours(full, palette), np.ones_like(dots)[None]])
    return as_plane(under + (over - under) * dots)


def _as_seen(light: NDArray[np.float32], coverage: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what a client that blends in sRGB shows over black, linear: sRGB(c) · coverage.

    ``light`` (3, pixels) is premultiplied by ``coverage`` (pixels,).
    """
    straight = encode_unit(as_plane(light / np.maximum(coverage, _MIN_DIVISOR)))
    seen = decode_unit(as_plane(straight * coverage))
    return as_plane(np.where((coverage > 0) & (coverage < 1), seen, light))


def _to_be_seen(light: NDArray[np.float32], coverage: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the premultiplied light of which a client that blends in sRGB shows ``light``.

    The inverse of ``_as_seen``.
    """
    straight = encode_unit(light) / np.maximum(coverage, _MIN_DIVISOR)
    return as_plane(np.where(coverage < 1, decode_unit(as_plane(straight)) * coverage, light))


def _blended(
    flame: NDArray[np.float32],
    flakes: NDArray[np.float32],
    coverage: NDArray[np.float32],
    blend: str,
) -> NDArray[np.float32]:
    """Blend the flame's light as shown with the flakes' light before exposure, both (3, pixels).

    ``coverage`` (pixels,) is that of the flakes.
    """
    if blend == "add":
        return exposed_together(flame, flakes)
    light = expose(flakes)
    if blend == "screen":
        return as_plane(flame + light - np.minimum(flame, 1.0) * light)
    return as_plane(light + flame * (1 - coverage))


def exposed_together(shown: NDArray[np.float32], light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what film shows of ``light`` added to the light of which it has ``shown``; any shape.

    y was shown of y / (1 − y); adding x to that and exposing it gives (y + z) / (1 + z) with
    z = x (1 − y). White is taken for the last step below it, so that very bright light shows on it.
    """
    added = light * (1 - np.minimum(shown, _WHITE))
    return as_plane(np.maximum((shown + added) / (1 + added), shown))


def emitted(
    under: NDArray[np.float32], flakes: NDArray[np.float32], blend: str, blend_space: str
) -> NDArray[np.float32]:
    """Return the light that film, exposed to it, shows as ``compose`` does over black: (4, pixels).

    The inverse of the exposure x / (1 + x), in closed form, so that light far brighter than white
    is kept. Flakes that are added or screened cover nothing; with ``over`` they cover in proportion
    to their exposed light.

    Args:
        under: (4, pixels), the flame's premultiplied linear light and coverage.
        flakes: (3, pixels), light of the flake layer on black.
        blend: ``add``, ``screen`` or ``over``.
        blend_space: Where the client blends that the flame was made for.
    """
    coverage, shown = under[3], under[:3]
    if blend_space == "srgb":
        shown = _as_seen(shown, coverage)
    shown = np.minimum(shown, _WHITE)
    pixels = np.empty_like(under)
    pixels[3] = coverage
    if blend == "over":
        flake_coverage = expose(flakes.max(axis=0))
        pixels[3] += flake_coverage * (1 - coverage)
        # What still shows of the flame, relative to 1 less what is shown of the flakes.
        shown = shown * (1 - flake_coverage) * (1 + flakes)
        pixels[:3] = (flakes + shown) / (1 - shown)
        return pixels
    flame = shown / (1 - shown)
    pixels[:3] = flame + flakes + (flame * flakes if blend == "screen" else 0)
    return pixels


def clip_palette(clip: Clip, workers: Workers) -> NDArray[np.float32]:
    """Return the most frequent opaque colours of a clip, (colours, 3) sRGB in 0..1."""
    samples = evenly_spread(0, clip.count - 1, _PALETTE_SAMPLES)
    counted = np.zeros(1 << 24, np.int64)
    for codes in workers.map(lambda i: _opaque_codes(clip, i), samples):
        np.add.at(counted, codes, 1)
    used = np.flatnonzero(counted)
    frequent = used[np.argsort(-counted[used], kind="stable")][:_PALETTE_SIZE]
    if frequent.size == 0:
        frequent = np.array([0xFFFFFF])
    channels = np.stack([frequent >> 16, frequent >> 8 & 255, frequent & 255], axis=1)
    return (channels / 255).astype(np.float32)


def _opaque_codes(clip: Clip, i: int) -> NDArray[np.int64]:
    """Return 0xRRGGBB of every pixel of frame ``i`` that is more than half covered."""
    pixels = clip.read(i)
    solid = pixels[pixels[..., 3] > 0.5][None]
    red, green, blue = encode_bytes(unpremultiply(solid))[0].T.astype(np.int64)
    return np.asarray(red << 16 | green << 8 | blue, np.int64)


def _nearest_colours(
    pixels: NDArray[np.float32], palette: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Linear light (3, pixels) of the palette colour nearest in sRGB to each of (3, pixels)."""
    shown = encode_unit(pixels)
    # |p − s|² − |s|². Not a matrix product: numpy's threads may change its last bits.
    square = (palette**2).sum(axis=1) - 2 * np.einsum("ci,jc->ij", shown, palette)
    return srgb_to_linear(palette[np.argmin(square, axis=1)]).T
