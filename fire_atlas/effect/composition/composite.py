"""Composition: blend the flake layer with the flame layer, in linear light."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.clip import Clip
from fire_atlas.core.pixels import (
    as_plane,
    decode_unit,
    encode_bytes,
    encode_unit,
    srgb_to_linear,
    unpremultiply,
)
from fire_atlas.core.workers import Workers
from fire_atlas.vision.sampling import evenly_spread

_MIN_DIVISOR = np.float32(1e-6)
"""Minimum coverage that light is divided by."""

_MIN_VISIBLE = 0.25
"""Brightness (sRGB, 0..1) from which a flake is drawn in a colour of the palette. Dimmer ones are
left out: a palette of few colours cannot show them fade."""

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
) -> NDArray[np.float32]:
    """Blend flakes with the flame behind them, pixel by pixel: (pixels, 4).

    ``add``: flame + flakes. ``screen``: 1 − (1 − flame)(1 − flakes). ``over``: flakes hide the
    flame in proportion to their light. Coverage is raised so that flakes show on an empty
    background too: to their brightest channel, encoded in the client's blend space.

    Args:
        under: (pixels, 4), the flame's premultiplied linear light and coverage.
        flakes: (pixels, 3), light of the flake layer on black.
        blend: ``add``, ``screen`` or ``over``.
        blend_space: Where the client blends, which decides how much coverage light needs.
        palette: (colours, 3) sRGB in 0..1. If given, pixels whose flakes are bright enough to be
            seen take the nearest of these colours, fully opaque; all others stay as they are.
    """
    light = expose(flakes)
    brightest = _brightest(light)
    shown = encode_unit(brightest)
    cover = brightest
    if blend_space == "srgb":
        # On an empty background the client shows sRGB(c) · cover; with this c it is sRGB(light).
        cover = shown
        alone = decode_unit(as_plane(encode_unit(light) / np.maximum(cover, _MIN_DIVISOR))) * cover
        light = as_plane(alone + (light - alone) * under[:, 3:])
    joined = _blended(under[:, :3], light, brightest, blend)
    needed = np.minimum(_brightest(joined)[:, 0], 1.0)
    pixels = np.empty_like(under)
    pixels[:, :3] = joined
    pixels[:, 3] = np.maximum(under[:, 3] + cover[:, 0] * (1 - under[:, 3]), needed)
    if palette is not None:
        pixels[:, :3] = _nearest_colours(pixels, palette)
        pixels[:, 3] = 1.0
        faint = shown[:, 0] < _MIN_VISIBLE
        pixels[faint] = under[faint]
    return pixels


def _blended(
    under: NDArray[np.float32], light: NDArray[np.float32], cover: NDArray[np.float32], blend: str
) -> NDArray[np.float32]:
    """Blend the flame's light ``under`` the flakes with the flakes' ``light``, both (pixels, 3).

    ``cover`` (pixels, 1) is the coverage of the flakes.
    """
    if blend == "add":
        return under + light
    if blend == "screen":
        return as_plane(under + light - np.minimum(under, 1.0) * light)
    return light + under * (1 - cover)


def expose(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Scale HDR light (pixels, 3) to 0..1 by its brightest channel; clipping would change hues."""
    return as_plane(light / np.maximum(_brightest(light), 1.0))


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
    """Linear light (pixels, 3) of the palette colour nearest in sRGB to each of (pixels, 4)."""
    shown = encode_unit(pixels[:, :3])
    # |p − s|² − |s|². Not a matrix product: numpy's threads may change its last bits.
    square = (palette**2).sum(axis=1) - 2 * np.einsum("ic,jc->ij", shown, palette)
    return srgb_to_linear(palette[np.argmin(square, axis=1)])


def _brightest(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Brightest channel (pixels, 1) of light (pixels, 3). numpy is slow along a short axis."""
    red, green, blue = light.T
    return as_plane(np.maximum(np.maximum(red, green), blue)[:, None])
