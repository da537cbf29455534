"""Page images: written in the format a recipe asks for, and read back. Nothing is lost in any."""

import io
from pathlib import Path
from typing import BinaryIO, assert_never

import numpy as np
from PIL import Image

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MIB, read_file
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.png import write_png, write_small_png
from fire_atlas.formats.pages.webp import write_webp
from fire_atlas.recipe.output import Atlas

_MOST_BYTES = 2048 * MIB
"""Largest file of a page: one of 16384 px a side, not compressed at all, is half of that."""


def write_page(file: BinaryIO, image: Bytes, settings: Atlas, workers: Workers) -> None:
    """Write an (H, W, 4) uint8 RGBA page."""
    match settings.format:
        case "webp":
            write_webp(file, image, settings.compression, workers)
        case "png":
            write = write_small_png if settings.compression == "small" else write_png
            write(file, image, workers)
        case _:
            assert_never(settings.format)


def read_page(path: Path, width: int, height: int) -> Bytes:
    """Return the pixels of a page, (H, W, 4) uint8 RGBA as they were written.

    Raises:
        SourceError: The file is missing, damaged, or no image of ``width`` x ``height`` px.
    """
    data = read_page_file(path, width, height)
    try:
        with Image.open(io.BytesIO(data)) as image:
            # A small file has no channels that say nothing.
            return np.array(image.convert("RGBA"))
    except Exception as error:  # decoders raise what they like
        raise SourceError(f"{path}: is damaged ({error}); build the recipe again") from error


def read_page_file(path: Path, width: int, height: int) -> bytes:
    """Return the bytes of a page's file, of whose image only the header is looked at.

    Raises:
        SourceError: The file is missing, or no image of ``width`` x ``height`` px.
    """
    try:
        data = read_file(path, _MOST_BYTES)
    except OSError as error:
        raise SourceError(f"{path}: the page cannot be read ({error.strerror})") from None
    try:
        with Image.open(io.BytesIO(data), formats=["PNG", "WEBP"]) as image:
            size = image.size
    except Exception as error:  # decoders raise what they like
        raise SourceError(f"{path}: is no PNG or WebP; build the recipe again") from error
    if size != (width, height):
        raise SourceError(
            f"{path}: is {size[0]}x{size[1]}, but the atlas says {width}x{height}; "
            f"build the recipe again"
        )
    return data
