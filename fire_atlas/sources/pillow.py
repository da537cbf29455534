"""Read image files by Pillow: JPEG, BMP, TGA and others, and the tags of TIFF."""

import io
import warnings
from pathlib import Path
from typing import BinaryIO

import numpy as np
from PIL import Image, TiffImagePlugin

from fire_atlas.core.files import open_file
from fire_atlas.core.picture import Picture
from fire_atlas.sources import icc
from fire_atlas.sources.broken import BrokenFileError, UnexpectedAnimationError
from fire_atlas.sources.colours import AS_SRGB, FileColours
from fire_atlas.sources.header import Header
from fire_atlas.sources.orientation import TAG, UPRIGHT, marked_upright, valid

# Sizes are checked before anything is decoded, so Pillow's own limit is switched off. Its warnings
# would only repeat our errors on stderr, or complain about files that are read well.
Image.MAX_IMAGE_PIXELS = None
warnings.filterwarnings("ignore", category=UserWarning, module=r"PIL\.")


_GREY_MODES = ("1", "L", "LA", "La", "I;16")
_GREY, _WHITE_IS_0, _CMYK = 1, 0, 5
"""Values of a TIFF's tag PhotometricInterpretation."""

_FLOAT = 3
"""Value of a TIFF's tag SampleFormat."""

_TILE_WIDTH, _TILE_LENGTH = 322, 323
"""Tags of a TIFF."""

_MAX_TILE_SIDE = 4096
"""Limit on the sides of a TIFF's tiles, px, where they are larger than the picture: a decoder holds
a whole tile."""


def read_pillow_header(path: Path, kind: str) -> Header:
    """Return what an image file of format ``kind`` says about its picture."""
    with open_file(path) as file:
        if kind == "tiff":
            return _tiff_header(_tiff_tags(file))
        with Image.open(file, formats=(kind,)) as image:
            orientation, colours = UPRIGHT, AS_SRGB
            if kind == "jpeg":
                orientation = valid(image.getexif().get(TAG, UPRIGHT))
                profile = image.info.get("icc_profile") or b""
                if image.mode == "CMYK":
                    colours = _colours_of_cmyk(profile)
                elif profile:
                    space: icc.Space = "grey" if image.mode in _GREY_MODES else "RGB"
                    colours = icc.colours_of(profile, space, 8)
            return Header.of_stored(kind, image.size, orientation, colours)


def _tiff_header(tags: TiffImagePlugin.ImageFileDirectory_v2) -> Header:
    photometric = tags.get(TiffImagePlugin.PHOTOMETRIC_INTERPRETATION)
    bits = max(tags.get(TiffImagePlugin.BITSPERSAMPLE, (1,)))
    profile = tags.get(TiffImagePlugin.ICCPROFILE) or b""
    colours = AS_SRGB
    if photometric == _CMYK:
        colours = _colours_of_cmyk(profile)
    elif profile:
        space: icc.Space = "grey" if photometric in (_GREY, _WHITE_IS_0) else "RGB"
        colours = icc.colours_of(profile, space, 16 if bits > 8 else 8)
        if _FLOAT in tags.get(TiffImagePlugin.SAMPLEFORMAT, ()) and colours != AS_SRGB:
            note = "its numbers are taken as linear light of sRGB, whatever its colour profile says"
            colours = FileColours(notes=(note,))
    size = int(tags[TiffImagePlugin.IMAGEWIDTH]), int(tags[TiffImagePlugin.IMAGELENGTH])
    tile = int(tags.get(_TILE_WIDTH, 0)), int(tags.get(_TILE_LENGTH, 0))
    if any(side > max(_MAX_TILE_SIDE, 2 * whole) for side, whole in zip(tile, size, strict=True)):
        raise BrokenFileError(f"its tiles are {tile[0]}x{tile[1]} for {size[0]}x{size[1]} pixels")
    return Header.of_stored("tiff", size, valid(tags.get(TAG, UPRIGHT)), colours)


def _colours_of_cmyk(profile: bytes) -> FileColours:
    """Return notes on the colours of inks; ``decode_by_pillow`` converts them."""
    if icc.cmyk_transform(profile) is not None:
        return FileColours(notes=("its inks (CMYK) are converted to sRGB by its colour profile",))
    has = "a broken colour profile" if profile else "no colour profile"
    return FileColours(notes=(f"it is CMYK with {has}: its colours are a guess; export it in RGB",))


def decode_by_pillow(data: bytes, kind: str) -> Picture:
    """Return the picture in the bytes of a still image of format ``kind``, as it is stored; a
    colour marked as transparent gets alpha 0, and inks (CMYK) become sRGB.

    Raises:
        UnexpectedAnimationError: The file has several frames.
        Exception: It is damaged; Pillow raises many types.
    """
    # As this kind alone: Pillow knows dozens, of which some start other programs (EPS).
    stored = io.BytesIO(marked_upright(data) if kind == "tiff" else data)
    image = Image.open(stored, formats=(kind,))
    if kind in ("gif", "webp") and getattr(image, "n_frames", 1) > 1:
        raise UnexpectedAnimationError
    image.load()
    if image.mode == "CMYK":
        transform = icc.cmyk_transform(image.info.get("icc_profile") or b"")
        return np.asarray(transform.apply(image) if transform else image.convert("RGB"))
    through = image.has_transparency_data or image.mode in ("La", "RGBa")
    straight = image.convert("LA") if image.mode == "La" else image
    return np.asarray(straight.convert("RGBA" if through else "RGB"))


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
