"""Read one image file: format from its first bytes, size from its header, then the pixels.

OpenCV decodes PNG and 16-bit or float TIFF: it keeps their precision and lets other threads run.
OpenEXR decodes EXR. Pillow decodes all other formats (``pillow.py``), because it raises an error
for a truncated file, where OpenCV fills in grey or prints a message. Builds from PNG do without its
import, which takes 10 ms.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.file_kinds import HEIC_BRANDS, misnamed
from fire_atlas.core.files import MIB, open_file, read_file
from fire_atlas.core.picture import Picture, with_alpha
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.sources import gif, icc, png, webp
from fire_atlas.sources.broken import BrokenFileError, UnexpectedAnimationError
from fire_atlas.sources.colours import AS_SRGB
from fire_atlas.sources.exr import decode_exr, find_picture, require_openexr
from fire_atlas.sources.header import Header
from fire_atlas.sources.listing import VIDEOS
from fire_atlas.sources.orientation import marked_upright, orientation_of, turned
from fire_atlas.sources.png_colours import colours_of_png

MAX_SIDE = 16384
_MAX_BYTES = 2048 * MIB

# OpenCV's log would only repeat our errors on stderr.
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

ANIMATIONS = ("gif", "png", "webp")
"""Formats whose files can be animations or still images."""


def read_bytes(path: Path, head: int | None = None) -> bytes:
    """Return the bytes of a file, or only the first ``head`` ones.

    Raises:
        SourceError: It cannot be read, is not a file, or is too large.
    """
    if path.is_dir():
        raise SourceError(f"{path}: is a folder where an image was expected")
    try:
        if head is None:
            return read_file(path, _MAX_BYTES)
        with open_file(path) as file:
            return file.read(head)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror})") from error


def detect_format(path: Path) -> str:
    """Return the format of a file by its first bytes: ``png``, ``gif``, ..., ``video``.

    Raises:
        SourceError: The file is empty or of an unknown format.
    """
    head = read_bytes(path, 32)
    if not head:
        raise SourceError(f"{path}: the file is empty (0 bytes)")
    if known := _by_signature(head):
        return known
    if what := misnamed(head):
        raise SourceError(f"{path}: is {what}")
    suffix = path.suffix.lower()
    if known := {".tga": "tga", **dict.fromkeys(VIDEOS, "video")}.get(suffix):
        return known
    says = f", though its name says {suffix[1:].upper()}" if suffix else ""
    raise SourceError(
        f"{path}: is not an image or a video (it begins with {head[:12]!r}){says}; "
        "give PNG, GIF, WebP, JPEG, TGA, BMP, TIFF, EXR or a video"
    )


def _by_signature(head: bytes) -> str | None:
    if head[:4] == b"RIFF":
        return {b"WEBP": "webp", b"AVI ": "video"}.get(head[8:12])
    if head[4:8] == b"ftyp" and head[8:12] not in HEIC_BRANDS:
        return "video"
    signatures = {
        png.SIGNATURE: "png", b"GIF87a": "gif", b"GIF89a": "gif", b"\xff\xd8\xff": "jpeg",
        b"II*\0": "tiff", b"MM\0*": "tiff", b"v/1\x01": "exr", b"\x1aE\xdf\xa3": "video",
        b"BM": "bmp",
    }  # fmt: skip
    return next((name for mark, name in signatures.items() if head.startswith(mark)), None)


def read_header(path: Path, max_pixels: int = MAX_PIXELS, layer: str | None = None) -> Header:
    """Return what a file says about its picture, without decoding a pixel.

    Args:
        path: The file.
        max_pixels: Limit on the pixels of the picture.
        layer: Which layer of an EXR file is read (``source.layer``); None for the finished picture.

    Raises:
        SourceError: The file is unreadable, of an unknown format, too large, or has no such layer.
    """
    kind = detect_format(path)
    if kind == "video":
        raise SourceError(f"{path}: is a video, not an image; to use it, give that file as path")
    check_layer(path, kind, layer)
    try:
        header = _header(path, kind, layer)
    except SourceError:
        raise
    except BrokenFileError as error:
        raise SourceError(f"{path}: {error}; export it again") from error
    except Exception as error:
        raise SourceError(f"{path}: broken {kind.upper()} file ({error})") from error
    check_size(path, header.width, header.height, max_pixels)
    return header


def shared_notes(headers: Mapping[Path, Header]) -> tuple[str, ...]:
    """Return the notes on several images, each once; with the files' names, if not on all."""
    files_of: dict[str, list[Path]] = {}
    for path, header in headers.items():
        for note in header.notes:
            files_of.setdefault(note, []).append(path)
    notes = []
    for note, (first, *others) in files_of.items():
        more = f" and {len(others)} more" if others else ""
        is_of_all = len(others) + 1 == len(headers)
        notes.append(note if is_of_all else f"{first.name}{more}: {note}")
    return tuple(notes)


def check_layer(path: Path, kind: str, layer: str | None) -> None:
    """Refuse ``source.layer`` for a file of format ``kind`` that has no layers.

    Raises:
        SourceError: With what the file is.
    """
    if layer is not None and kind != "exr":
        what = "a video" if kind == "video" else kind.upper()
        raise SourceError(
            f"names a layer of EXR files, but {path} is {what}; leave it out",
            key=("source", "layer"),
        )


def check_size(where: Path | str, width: int, height: int, max_pixels: int = MAX_PIXELS) -> None:
    """Refuse pictures that are empty or exceed the limits.

    Raises:
        SourceError: With the size, the limit, and how to raise it.
    """
    if width < 1 or height < 1:
        raise SourceError(f"{where}: the picture has no pixels ({width}x{height})")
    is_long = max(width, height) > MAX_SIDE
    if is_long or width * height > max_pixels:
        raising = "" if is_long else f"; to allow it, say --limit-pixels {width * height}"
        raise SourceError(
            f"{where}: {width}x{height} is too large; the limits are {MAX_SIDE} px a side "
            f"and {max_pixels / 1e6:.3g} megapixels{raising}"
        )


def _header(path: Path, kind: str, layer: str | None) -> Header:
    if kind == "gif":
        animation = gif.parse(read_bytes(path))
        header = Header.of_stored(kind, (animation.width, animation.height))
        return replace(header, notes=animation.notes)
    if kind in ("png", "webp", "exr"):
        with open_file(path) as file:
            if kind == "png":
                head = png.read_head(file)
                orientation = orientation_of(head.chunks.get(b"eXIf", b""))
                size = head.width, head.height
                return Header.of_stored(kind, size, orientation, colours_of_png(head))
            if kind == "webp":
                size, exif, profile = webp.read_head(file)
                colours = icc.colours_of(profile, "RGB", 8) if profile else AS_SRGB
                return Header.of_stored(kind, size, orientation_of(exif), colours)
            require_openexr(path)
            picture = find_picture(path, file, layer)
            return Header(kind, *picture.size, exr=picture, notes=picture.notes)
    from fire_atlas.sources.pillow import read_pillow_header

    return read_pillow_header(path, kind)


def decode(path: Path, header: Header) -> Picture:
    """Return the picture in a still image file.

    Raises:
        SourceError: The file is cut short, damaged or animated, or its size is not the header's.
    """
    data = read_bytes(path)
    try:
        picture = _decoded(data, header)
    except (SourceError, MemoryError):
        raise
    except UnexpectedAnimationError as error:
        raise SourceError(f"{path}: {error}") from error
    except BrokenFileError as error:
        raise SourceError(f"{path}: {error}; export it again") from error
    except Exception as error:
        raise SourceError(f"{path}: broken {header.format.upper()} file ({error})") from error
    if picture.shape[:2] != (header.height, header.width):
        raise SourceError(
            f"{path}: decodes to {picture.shape[1]}x{picture.shape[0]}, but its header says "
            f"{header.width}x{header.height}"
        )
    return picture


def _decoded(data: bytes, header: Header) -> Picture:
    if header.exr is not None:
        return finite_light(decode_exr(data, header.exr))
    is_gif = header.format == "gif"
    picture = _decode_gif(data) if is_gif else decode_bytes(data, header.format)
    if header.conversion is not None:
        picture = header.conversion.apply(picture)
    return turned(picture, header.orientation)


def decode_bytes(data: bytes, kind: str) -> Picture:
    """Return the picture in the bytes of a still image of format ``kind``, but EXR, as it is
    stored: not turned, and in the colours of the file."""
    if kind == "png":
        return _decode_png(data)
    from fire_atlas.sources.pillow import decode_by_pillow, deep_tiff_samples

    if kind == "tiff" and (samples := deep_tiff_samples(data)) is not None:
        return _decode_deep_tiff(data, samples)
    return decode_by_pillow(data, kind)


def _decode_gif(data: bytes) -> Picture:
    """Return the screen of a GIF with one frame, which need not fill it."""
    animation = gif.parse(data)
    if len(animation.patches) > 1:
        raise UnexpectedAnimationError
    if not animation.patches:
        raise BrokenFileError("this GIF holds no frames")
    patch = animation.patches[0]
    picture = decode_bytes(animation.wrap(patch, data[patch.start : patch.stop]), "gif")
    if (patch.x, patch.y, *picture.shape[:2]) == (0, 0, animation.height, animation.width):
        return picture
    screen = np.zeros((animation.height, animation.width, 4), np.uint8)
    area = screen[patch.y : patch.y + patch.height, patch.x : patch.x + patch.width]
    area[...] = with_alpha(picture)[: area.shape[0], : area.shape[1]]
    return screen


def _decode_png(data: bytes) -> Picture:
    found = list(png.chunks(data))
    if png.stated_frame_count(data, found) > 1:
        raise UnexpectedAnimationError
    plain = png.essential_chunks(data, found)
    raw = cv2.imdecode(np.frombuffer(plain, np.uint8), cv2.IMREAD_UNCHANGED)
    if raw is None:
        raise BrokenFileError("the compressed pixels are damaged")
    key = next((data[c.start : c.stop] for c in found if c.name == b"tRNS"), b"")
    if raw.ndim == 2 and len(key) == 2:
        return _with_grey_key(raw, int.from_bytes(key, "big"), depth=data[24])
    return from_opencv(raw)


def _with_grey_key(grey: Picture, key: int, depth: int) -> Picture:
    """Make the grey value ``key`` transparent (tRNS), which OpenCV does not."""
    top = int(np.iinfo(grey.dtype).max)
    full = with_alpha(np.dstack([grey, grey, grey]))
    full[..., 3][grey == key * top // ((1 << depth) - 1)] = 0
    return full


def from_opencv(raw: Picture) -> Picture:
    """Convert a picture decoded by OpenCV (grey, BGR or BGRA) to R, G, B(, A)."""
    if raw.ndim == 2:
        return cast(Picture, cv2.cvtColor(raw, cv2.COLOR_GRAY2RGB))
    order = cv2.COLOR_BGRA2RGBA if raw.shape[2] == 4 else cv2.COLOR_BGR2RGB
    return cast(Picture, cv2.cvtColor(raw, order))


def finite_light(values: Picture) -> Picture:
    """Return float32 light from a file, (H, W, 3 or 4), made valid: NaN and negatives become 0."""
    light = np.nan_to_num(values, nan=0.0, posinf=65504.0, neginf=0.0)
    np.maximum(light, 0, out=light)
    if light.shape[2] == 4:
        np.minimum(light[..., 3], 1, out=light[..., 3])
    return light


def _decode_deep_tiff(data: bytes, extra: tuple[int, ...]) -> Picture:
    """Return a picture of more than 8 bits a channel; ``extra`` is its tag ExtraSamples."""
    stored = np.frombuffer(marked_upright(data), np.uint8)
    raw = cv2.imdecode(stored, cv2.IMREAD_UNCHANGED)
    if raw is None or raw.dtype not in (np.uint16, np.float32):
        raise BrokenFileError("this TIFF is cut short or not 8, 16 or 32 (float) bits a channel")
    picture = from_opencv(raw)
    if picture.dtype == np.float32:
        return finite_light(picture)
    if extra and extra[0] == 1 and picture.shape[2] == 4:
        # Integer pictures have straight alpha in this tool; ExtraSamples 1 means premultiplied.
        alpha = np.maximum(picture[..., 3:].astype(np.float64), 1)
        straight = picture[..., :3] * 65535.0 / alpha
        picture[..., :3] = np.rint(np.minimum(straight, 65535)).astype(np.uint16)
    return picture
