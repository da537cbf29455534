"""Write lossless WebP."""

from functools import partial
from typing import BinaryIO, Literal

from PIL import Image

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers

_EFFORT = {"fast": (0, 50), "small": (6, 100)}
"""Pillow's ``method`` and ``quality``; both are lossless, and only take longer."""


def write_webp(
    file: BinaryIO, image: Bytes, compression: Literal["fast", "small"], workers: Workers
) -> None:
    """Write an (H, W, 4) uint8 RGBA image to ``file``."""
    method, quality = _EFFORT[compression]
    # Exact: light and colour under alpha 0 are part of the picture.
    save = partial(Image.fromarray(image).save, lossless=True, exact=True, method=method)
    workers.start(lambda: save(file, "WEBP", quality=quality)).result()
