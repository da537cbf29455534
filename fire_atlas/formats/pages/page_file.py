"""Write a page in the format a recipe asks for. Nothing is lost in any of them."""

import io
from importlib import import_module
from typing import BinaryIO

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.png import write_png
from fire_atlas.recipe.output import Atlas

_WEBP_EFFORT = {"fast": (0, 50), "small": (6, 100)}
"""Pillow's ``method`` and ``quality``; both are lossless, and only take longer."""

_OXIPNG_LEVEL, _OXIPNG_FILTERS = 2, ("NoOp", "Sub", "MinSum", "Entropy", "Bigrams", "Brute")
"""On fire as small as level 4 to within 0.5 %, in a quarter of its time: more ways to filter rows
pay, more ways to deflate them do not."""


def write_page(file: BinaryIO, image: Bytes, settings: Atlas, workers: Workers) -> None:
    """Write an (H, W, 4) uint8 RGBA page."""
    match settings.format, settings.compression:
        case "webp", _:
            file.write(_webp(image, settings))
        case "png", "small":
            whole = io.BytesIO()
            write_png(whole, image, workers)
            file.write(_smallest_png(whole.getvalue()))
        case _:
            write_png(file, image, workers)


def _webp(image: Bytes, settings: Atlas) -> bytes:
    from PIL import Image

    method, quality = _WEBP_EFFORT[settings.compression]
    whole = io.BytesIO()
    # Exact: light and colour under alpha 0 are part of the picture.
    Image.fromarray(image).save(
        whole, "WEBP", lossless=True, exact=True, method=method, quality=quality
    )
    return whole.getvalue()


def _smallest_png(png: bytes) -> bytes:
    oxipng = import_module("oxipng")
    filters = [getattr(oxipng.RowFilter, name) for name in _OXIPNG_FILTERS]
    smaller: bytes = oxipng.optimize_from_memory(png, level=_OXIPNG_LEVEL, filter=filters)
    return smaller
