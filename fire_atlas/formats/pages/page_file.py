"""Page images: written in the format a recipe asks for, and read back. Nothing is lost in any."""

import io
from pathlib import Path
from typing import BinaryIO

import cv2
import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.png import write_png, write_small_png
from fire_atlas.formats.pages.webp import write_webp
from fire_atlas.recipe.output import Atlas


def write_page(file: BinaryIO, image: Bytes, settings: Atlas, workers: Workers) -> None:
    """Write an (H, W, 4) uint8 RGBA page."""
    match settings.format, settings.compression:
        case "webp", compression:
            write_webp(file, image, compression)
        case "png", "small":
            write_small_png(file, image, workers)
        case _:
            write_png(file, image, workers)


def read_page(path: Path, width: int, height: int) -> Bytes:
    """Return the pixels of a page, (H, W, 4) uint8 RGBA as they were written.

    Raises:
        SourceError: The file is missing, or no 8-bit image of ``width`` x ``height`` px.
    """
    data = np.frombuffer(read_page_file(path, width, height), np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint8:
        raise SourceError(f"{path}: is no 8-bit image; build the recipe again")
    return _rgba(np.asarray(image, np.uint8))


def read_page_file(path: Path, width: int, height: int) -> bytes:
    """Return the bytes of a page's file; of the image only the header is looked at.

    Raises:
        SourceError: The file is missing, or no image of ``width`` x ``height`` px.
    """
    from PIL import Image

    try:
        data = path.read_bytes()
    except OSError as error:
        raise SourceError(f"{path}: the page cannot be read ({error.strerror})") from None
    try:
        with Image.open(io.BytesIO(data), formats=["PNG", "WEBP"]) as image:
            size = image.size
    except (OSError, Image.DecompressionBombError) as error:
        raise SourceError(f"{path}: is no PNG or WebP; build the recipe again") from error
    if size != (width, height):
        raise SourceError(
            f"{path}: is {size[0]}x{size[1]}, but the atlas says {width}x{height}; "
            f"build the recipe again"
        )
    return data


def _rgba(image: Bytes) -> Bytes:
    """Return what OpenCV decoded as RGBA; a small file has no channels that say nothing."""
    if image.ndim == 2:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGBA), np.uint8)
    order = cv2.COLOR_BGRA2RGBA if image.shape[2] == 4 else cv2.COLOR_BGR2RGBA
    return np.asarray(cv2.cvtColor(image, order), np.uint8)
