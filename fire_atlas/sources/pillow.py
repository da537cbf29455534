"""Read image files by Pillow: JPEG, BMP, TGA and others, and the tags of TIFF."""

import io
import warnings
from pathlib import Path
from typing import BinaryIO

import numpy as np
from PIL import Image, ImageOps, TiffImagePlugin

from fire_atlas.core.files import open_file
from fire_atlas.core.picture import Picture
from fire_atlas.sources.broken import UnexpectedAnimationError

# Sizes are checked before anything is decoded, so Pillow's own limit is switched off. Its warnings
# would only repeat our errors on stderr, or complain about files that are read well.
Image.MAX_IMAGE_PIXELS = None
warnings.filterwarnings("ignore", category=UserWarning, module=r"PIL\.")


def pillow_size(path: Path, kind: str) -> tuple[int, int]:
    """Return the width and height, px, of an image file of format ``kind``, upright."""
    with open_file(path) as file:
        if kind == "tiff":
            tags = _tiff_tags(file)
            return int(tags[TiffImagePlugin.IMAGEWIDTH]), int(tags[TiffImagePlugin.IMAGELENGTH])
        with Image.open(file) as image:
            rotated = kind == "jpeg" and image.getexif().get(0x0112, 1) >= 5
            width, height = image.size
            return (height, width) if rotated else (width, height)


def decode_by_pillow(data: bytes, kind: str) -> Picture:
    """Return the upright picture in the bytes of a still image of format ``kind``; a colour marked
    as transparent gets alpha 0.

    Raises:
        UnexpectedAnimationError: The file has several frames.
        Exception: It is damaged; Pillow raises many types.
    """
    opened = Image.open(io.BytesIO(data))
    if kind in ("gif", "webp") and getattr(opened, "n_frames", 1) > 1:
        raise UnexpectedAnimationError
    opened.load()
    image = ImageOps.exif_transpose(opened) if kind == "jpeg" else opened
    through = image.has_transparency_data or image.mode in ("La", "RGBa")
    if image.mode == "La":
        image = image.convert("LA")
    return np.asarray(image.convert("RGBA" if through else "RGB"))


def deep_tiff_samples(data: bytes) -> tuple[int, ...] | None:
    """Return the tag ExtraSamples of a TIFF of more than 8 bits a channel, empty if it has none;
    None if it has 8 bits."""
    tags = _tiff_tags(io.BytesIO(data))
    if max(tags.get(TiffImagePlugin.BITSPERSAMPLE, (1,))) <= 8:
        return None
    return tuple(tags.get(TiffImagePlugin.EXTRASAMPLES) or ())


def _tiff_tags(file: BinaryIO) -> TiffImagePlugin.ImageFileDirectory_v2:
    """Return the tags of the first picture. Pillow cannot open colour TIFFs of floats as images."""
    tags = TiffImagePlugin.ImageFileDirectory_v2(file.read(8))
    file.seek(tags.next or 0)
    tags.load(file)
    return tags
