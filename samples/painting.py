"""From amounts of glowing gas to pixels: the fire ramp, palettes, and files.

Images are uint8, shape ``(height, width)`` for palette indices and ``(height, width, 4)`` for
straight-alpha RGBA.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

Field = npt.NDArray[np.float32]
Pixels = npt.NDArray[np.uint8]

#: Knots of the fire ramp: level in [0, 1], then red, green, blue (0-255) and opacity (0-1).
BLACKBODY = np.array(
    [
        [0.00, 150, 16, 0, 0.00],
        [0.12, 184, 28, 2, 0.13],
        [0.28, 218, 50, 4, 0.47],
        [0.42, 240, 86, 8, 0.76],
        [0.58, 252, 134, 20, 0.92],
        [0.74, 255, 184, 50, 0.98],
        [0.89, 255, 228, 122, 1.00],
        [1.00, 255, 250, 214, 1.00],
    ]
)


def fire_colours(level: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    """Straight-alpha RGBA in [0, 255], shape (..., 4), of levels in [0, 1]."""
    knots, red, green, blue, opacity = BLACKBODY.T
    curves = [np.interp(level, knots, curve) for curve in (red, green, blue, 255 * opacity)]
    return np.stack(curves, axis=-1)


def fire_palette(size: int = 256) -> Pixels:
    """``size`` RGBA colours from clear through deep red, orange and yellow to near white."""
    return np.asarray(np.rint(fire_colours(np.linspace(0, 1, size))), dtype=np.uint8)


def over_black(palette: Pixels) -> Pixels:
    """The (n, 3) colours an (n, 4) palette shows on black."""
    return np.rint(palette[:, :3] * (palette[:, 3:] / 255.0)).astype(np.uint8)


def soft_step(low: float, high: float, value: Field) -> Field:
    """0 below ``low``, 1 above ``high``, smooth in between."""
    t = np.clip((value - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t), dtype=np.float32)


def exposure(emission: Field, gain: float = 1.0) -> Field:
    """Level in [0, 1) a film would record of light in [0, inf)."""
    return np.asarray(1 - np.exp(-np.float32(gain) * emission), dtype=np.float32)


def quantise(level: Field, size: int = 256) -> Pixels:
    """Nearest palette index of each level."""
    return np.rint(np.clip(level, 0, 1) * (size - 1)).astype(np.uint8)


def layer_over(image: Field, colour: npt.ArrayLike, cover: Field) -> Field:
    """``image`` under a layer of ``colour`` (RGB, 0-255) which covers (h, w) shares in [0, 1].

    Both images are RGBA, 0-255, their colours multiplied by opacity.
    """
    rgb = np.broadcast_to(np.asarray(colour, np.float32), (*cover.shape, 3))
    layer = np.dstack([rgb, np.full(cover.shape, 255, np.float32)])
    return np.asarray(image + cover[..., None] * (layer - image), dtype=np.float32)


def straight(image: Field) -> Pixels:
    """Straight-alpha pixels of float RGBA, 0-255, whose colours are multiplied by opacity."""
    rgba = image.copy()
    rgba[..., :3] /= np.maximum(rgba[..., 3:] / 255, 1e-6)
    rgba[rgba[..., 3] < 0.5] = 0
    return np.rint(np.clip(rgba, 0, 255)).astype(np.uint8)


def coarser(pixels: Pixels, levels: int) -> Pixels:
    """Pixels whose channels keep to ``levels`` even steps from 0 to 255: far smaller PNGs."""
    step = 255 / (levels - 1)
    return np.rint(np.rint(pixels / step) * step).astype(np.uint8)


def save_indexed(path: Path, indices: Pixels, palette: Pixels) -> None:
    """Write an 8-bit palette PNG with an opacity per palette entry."""
    image = Image.fromarray(indices)
    image.putpalette(palette.tobytes(), "RGBA")
    image.save(path, optimize=True, transparency=palette[:, 3].tobytes())


def numbered(folder: Path, count: int) -> list[Path]:
    """Paths 0000.png, 0001.png, ... in ``folder``, made if need be and rid of older PNGs."""
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.glob("*.png"):
        stale.unlink()
    return [folder / f"{number:04d}.png" for number in range(count)]


def save_frames(folder: Path, frames: Sequence[Pixels], palette: Pixels) -> None:
    """Write ``frames`` of palette indices as numbered PNGs into a fresh ``folder``."""
    for path, indices in zip(numbered(folder, len(frames)), frames, strict=True):
        save_indexed(path, indices, palette)


def save_painted(folder: Path, frames: Sequence[Pixels]) -> None:
    """Write RGBA ``frames`` as numbered PNGs into a fresh ``folder``."""
    for path, frame in zip(numbered(folder, len(frames)), frames, strict=True):
        Image.fromarray(frame).save(path, optimize=True)


def save_gif(path: Path, frames: Sequence[Pixels], palette: Pixels, fps: int) -> None:
    """Write ``frames`` of palette indices as an endless GIF with one (n, 3) palette."""
    images = [Image.fromarray(indices) for indices in frames]
    for image in images:
        image.putpalette(palette.tobytes(), "RGB")
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=1000 // fps, loop=0, optimize=False
    )


def save_sheet(path: Path, frames: Sequence[Pixels], columns: int) -> None:
    """Write RGBA ``frames`` as one sprite sheet, row by row."""
    rows = [np.hstack(frames[i : i + columns]) for i in range(0, len(frames), columns)]
    Image.fromarray(np.vstack(rows)).save(path, optimize=True)
