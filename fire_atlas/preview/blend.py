"""Blend a stored frame over a background, as game engines do."""

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes, Pixels, decode_bytes, encode_bytes


def blend(
    frame: Bytes, background: tuple[int, int, int] | Bytes, alpha: str, blend_space: str
) -> Bytes:
    """Return a frame blended over a background, (H, W, 3) uint8 sRGB.

    Straight: rgb·a + bg·(1 − a). Premultiplied: rgb + bg·(1 − a). Additive: rgb + bg. In ``srgb``
    stored values are blended, in ``linear`` their linear light.

    Args:
        frame: (H, W, 4) uint8 RGBA, as stored in the page.
        background: A colour, or a picture (H, W, 3), sRGB, 0..255.
        alpha: ``straight``, ``premultiplied`` or ``additive``.
        blend_space: ``srgb`` or ``linear``.
    """
    behind = np.array(background, np.uint8, ndmin=3)
    if blend_space == "linear":
        light = _over(decode_bytes(frame[..., :3]), frame, decode_bytes(behind), alpha)
        return encode_bytes(light)
    unit = np.float32(1 / 255)
    shown = _over(frame[..., :3] * unit, frame, behind * unit, alpha)
    return np.asarray(np.rint(np.clip(shown, 0, 1) * np.float32(255)), np.uint8)


def _over(
    rgb: NDArray[np.float32], frame: Bytes, behind: NDArray[np.float32], alpha: str
) -> NDArray[np.float32]:
    if alpha == "additive":
        return rgb + behind
    cover = frame[..., 3:] * np.float32(1 / 255)
    return (rgb * cover if alpha == "straight" else rgb) + behind * (1 - cover)


def as_seen(frame: Bytes, alpha: str, blend_space: str) -> Pixels:
    """Return the frame as an engine shows it over black: linear colour, with the stored alpha."""
    light = decode_bytes(blend(frame, (0, 0, 0), alpha, blend_space))
    return np.dstack([light, frame[..., 3] * np.float32(1 / 255)])
