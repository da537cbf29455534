"""Textures of flakes, painted for tests: drops that fly to the right, their round head in front."""

from pathlib import Path

import numpy as np
from PIL import Image

from fire_atlas.core.pixels import Bytes

COLOURS = (255, 80, 20), (60, 255, 90), (70, 110, 255)
"""sRGB of the three cells of ``sheet``."""


def drop(colour: tuple[int, int, int] = COLOURS[0], width: int = 64, height: int = 24) -> Bytes:
    """Return a soft-edged drop of one colour, (height, width, 4)."""
    y, x = np.mgrid[:height, :width] + 0.5
    along, across = x / width, np.abs(y - height / 2) / (height / 2)
    head = np.sqrt(np.clip(1 - ((along - 0.8) / 0.2) ** 2, 0, 1))
    edge = 0.9 * np.where(along > 0.8, head, along / 0.8)
    image = np.empty((height, width, 4), np.uint8)
    image[..., :3] = colour
    image[..., 3] = 255 * np.clip((edge - across) * 4, 0, 1)
    return image


def sheet() -> Bytes:
    """Return a sheet of three drops side by side."""
    return np.hstack([drop(colour) for colour in COLOURS])


def saved(image: Bytes, path: Path) -> str:
    """Write an image, and return its path for a recipe."""
    Image.fromarray(image).save(path)
    return str(path)
