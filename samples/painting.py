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


def fire_palette(size: int = 256) -> Pixels:
    """``size`` RGBA colours from clear through deep red, orange and yellow to near white."""
    level = np.linspace(0, 1, size)
    knots, red, green, blue, opacity = BLACKBODY.T
    curves = [np.interp(level, knots, curve) for curve in (red, green, blue, 255 * opacity)]
    return np.asarray(np.rint(np.stack(curves, axis=1)), dtype=np.uint8)


def wood_palette(size: int) -> Pixels:
    """``size`` RGB colours from black to firelit brown."""
    t = np.linspace(0, 1, size)[:, None]
    colours = np.array([[150.0, 78.0, 34.0]]) * t ** np.array([[0.9, 1.05, 1.2]])
    return np.asarray(np.rint(colours), dtype=np.uint8)


def brighter(front: Pixels, front_colours: Pixels, back: Pixels, back_colours: Pixels) -> Pixels:
    """Of two (h, w) index images the brighter pixels; ``back`` indices follow the front ones."""
    offset = np.uint8(len(front_colours))
    front_light = front_colours.sum(axis=1, dtype=np.int32)[front]
    back_light = back_colours.sum(axis=1, dtype=np.int32)[back]
    return np.where(back_light > front_light, back + offset, front).astype(np.uint8)


def over_black(palette: Pixels) -> Pixels:
    """The (n, 3) colours an (n, 4) palette shows on black."""
    return np.rint(palette[:, :3] * (palette[:, 3:] / 255.0)).astype(np.uint8)


def exposure(emission: Field, gain: float = 1.0) -> Field:
    """Level in [0, 1) a film would record of light in [0, inf)."""
    return np.asarray(1 - np.exp(-np.float32(gain) * emission), dtype=np.float32)


def quantise(level: Field, size: int = 256) -> Pixels:
    """Nearest palette index of each level."""
    return np.rint(np.clip(level, 0, 1) * (size - 1)).astype(np.uint8)


def save_indexed(path: Path, indices: Pixels, palette: Pixels) -> None:
    """Write an 8-bit palette PNG with an opacity per palette entry."""
    image = Image.fromarray(indices)
    image.putpalette(palette.tobytes(), "RGBA")
    image.save(path, optimize=True, transparency=palette[:, 3].tobytes())


def save_frames(folder: Path, frames: Sequence[Pixels], palette: Pixels) -> None:
    """Write ``frames`` of palette indices as 0000.png, 0001.png, ... into a fresh ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.glob("*.png"):
        stale.unlink()
    for number, indices in enumerate(frames):
        save_indexed(folder / f"{number:04d}.png", indices, palette)


def save_gif(path: Path, frames: Sequence[Pixels], palette: Pixels, fps: int) -> None:
    """Write ``frames`` of palette indices as an endless GIF with one (256, 3) palette."""
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
