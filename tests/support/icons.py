"""A folder of generated icons, built like an icon theme: 994 names in 11 folders, 879 pictures."""

from pathlib import Path

import numpy as np
from PIL import Image

from fire_atlas.core.pixels import Bytes

SIDE, NAMES, PICTURES = 48, 994, 879
FOLDERS = (
    "actions", "apps", "categories", "devices", "emblems", "emotes", "legacy", "mimetypes",
    "places", "status", "ui",
)  # fmt: skip


def draw_theme(folder: Path) -> dict[str, Bytes]:
    """Write the icons, some with several endings to their names, and return them by their names."""
    chance = np.random.default_rng(43)
    pictures = [_icon(chance) for _ in range(PICTURES)]
    drawn = {}
    for i in range(NAMES):
        ending = "-symbolic.symbolic" if i % 3 == 0 else ""
        name = f"{FOLDERS[i % len(FOLDERS)]}/icon-{chr(97 + i % 26)}-{i}{ending}"
        drawn[name] = pictures[i % PICTURES]
        path = folder / f"{name}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(drawn[name]).save(path, compress_level=1)
    return drawn


def _icon(chance: np.random.Generator) -> Bytes:
    """Return a picture (48, 48, 4) of a few rectangles, clear around them."""
    image: Bytes = np.zeros((SIDE, SIDE, 4), np.uint8)
    for _ in range(3):
        x, y, width, height = chance.integers(1, 40, 4)
        image[y : y + height, x : x + width] = (*chance.integers(0, 256, 3), 255)
    return image
