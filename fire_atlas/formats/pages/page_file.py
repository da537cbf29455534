"""Read and write the image files of pages: PNG, or WebP, lossless or lossy.

Pillow is imported where it is needed: builds that write PNG do without it.
"""

import io
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, assert_never

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MIB, read_file
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.exr import write_exr
from fire_atlas.formats.pages.png import write_png, write_small_png
from fire_atlas.recipe.output import Atlas

_MAX_BYTES = 2048 * MIB
"""Maximum size of a page file: twice that of 16384 x 16384 px without compression."""

_WEBP_EFFORT = {"fast": (0, 50), "small": (6, 100)}
"""Pillow's ``method`` and ``quality``: lossless files get smaller, but take longer."""

_LOSSY_WEBP_EFFORT = {"fast": 4, "small": 6}
"""Pillow's ``method``. On fire, 6 takes about 20 times as long for 2 to 16 % less: most of it goes
into alpha."""


def write_page(
    file: BinaryIO, image: NDArray[Any], settings: Atlas, workers: Workers, *, is_data: bool = False
) -> None:
    """Write an (H, W, 4) RGBA page, or (H, W) of heat: as the settings say if it is uint8, as
    OpenEXR if float16.

    Data, which no client may get changed, is written without loss and states no colour space.
    """
    if image.dtype == np.float16:
        write_exr(file, image)
        return
    match settings.format:
        case "webp":
            if settings.quality == "lossless" or is_data:
                _write_lossless_webp(file, image, settings, workers)
            else:
                _write_lossy_webp(file, image, settings.quality, settings, workers)
        case "png":
            write = write_small_png if settings.compression == "small" else write_png
            write(file, image, workers, is_data=is_data)
        case _:
            assert_never(settings.format)


def _write_lossless_webp(file: BinaryIO, image: Bytes, settings: Atlas, workers: Workers) -> None:
    from PIL import Image

    method, quality = _WEBP_EFFORT[settings.compression]
    image = np.dstack([image] * 3) if image.ndim == 2 else image  # WebP has no grey
    # `exact` keeps colours where alpha is 0.
    save = partial(Image.fromarray(image).save, lossless=True, exact=True, method=method)
    workers.start(lambda: save(file, "WEBP", quality=quality)).result()


def _write_lossy_webp(
    file: BinaryIO, image: Bytes, quality: int, settings: Atlas, workers: Workers
) -> None:
    """Write an image whose colours may differ, but not its alpha."""
    from PIL import Image

    method = _LOSSY_WEBP_EFFORT[settings.compression]
    # Not `exact`, the encoder would put any colour where alpha is 0: light, on pages whose colours
    # are premultiplied or added.
    save = partial(Image.fromarray(image).save, alpha_quality=100, exact=True, method=method)
    workers.start(lambda: save(file, "WEBP", quality=quality)).result()


def read_page(path: Path, width: int, height: int) -> Bytes:
    """Return the pixels of a page, (H, W, 4) uint8 RGBA as they were written; those of one channel
    have its value in R, G and B.

    Raises:
        SourceError: The file is missing, damaged, or not an image of ``width`` x ``height`` px.
    """
    from PIL import Image

    data = read_page_file(path, width, height)
    try:
        with Image.open(io.BytesIO(data), formats=["PNG", "WEBP"]) as image:
            # oxipng drops unused channels.
            return np.array(image.convert("RGBA"))
    except Exception as error:  # decoders raise many types
        raise SourceError(f"{path}: is damaged ({error}); build the recipe again") from error


def read_page_file(path: Path, width: int, height: int) -> bytes:
    """Return the bytes of a page's file, after checking the size in its header.

    Raises:
        SourceError: The file is missing, or not an image of ``width`` x ``height`` px.
    """
    from PIL import Image

    try:
        data = read_file(path, _MAX_BYTES)
    except OSError as error:
        raise SourceError(f"{path}: the page cannot be read ({error.strerror})") from None
    try:
        with Image.open(io.BytesIO(data), formats=["PNG", "WEBP"]) as image:
            size = image.size
    except Exception as error:  # decoders raise many types
        raise SourceError(f"{path}: is neither PNG nor WebP; build the recipe again") from error
    if size != (width, height):
        raise SourceError(
            f"{path}: is {size[0]}x{size[1]}, but the atlas says {width}x{height}; "
            f"build the recipe again"
        )
    return data
