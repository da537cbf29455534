"""Read one image file: format from its first bytes, size from its header, then the pixels.

OpenCV decodes PNG and 16-bit or float TIFF: it keeps their precision and lets other threads run.
OpenEXR decodes EXR. Pillow decodes all other formats (``pillow.py``), because it raises an error
for a truncated file, where OpenCV fills in grey or prints a message. Builds from PNG do without its
import, which takes 10 ms.
"""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MIB, open_file, read_file
from fire_atlas.core.picture import Picture, with_alpha
from fire_atlas.sources import png
from fire_atlas.sources.broken import BrokenFileError, UnexpectedAnimationError
from fire_atlas.sources.exr import decode_exr, exr_size, require_openexr
from fire_atlas.sources.listing import MAX_PIXELS

MAX_SIDE = 16384
_MAX_BYTES = 2048 * MIB

# OpenCV's log would only repeat our errors on stderr.
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

VIDEOS = (".mp4", ".m4v", ".mov", ".webm", ".mkv", ".avi", ".mpg", ".mpeg", ".ogv", ".wmv", ".flv")
ANIMATIONS = ("gif", "png", "webp")
"""Formats whose files can be animations or still images."""


@dataclass(frozen=True, slots=True)
class Header:
    """Format and size, px, of an image file, from its first bytes."""

    format: str
    width: int
    height: int


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
    suffix = path.suffix.lower()
    known = _by_signature(head) or {".tga": "tga", **dict.fromkeys(VIDEOS, "video")}.get(suffix)
    if known:
        return known
    says = f", though its name says {suffix[1:].upper()}" if suffix else ""
    raise SourceError(
        f"{path}: is not an image or a video (it begins with {head[:12]!r}){says}; "
        "give PNG, GIF, WebP, JPEG, TGA, BMP, TIFF, EXR or a video"
    )


def _by_signature(head: bytes) -> str | None:
    if head[:4] == b"RIFF":
        return {b"WEBP": "webp", b"AVI ": "video"}.get(head[8:12])
    if head[4:8] == b"ftyp":
        return "video"
    signatures = {
        png.SIGNATURE: "png", b"GIF87a": "gif", b"GIF89a": "gif", b"\xff\xd8\xff": "jpeg",
        b"II*\0": "tiff", b"MM\0*": "tiff", b"v/1\x01": "exr", b"\x1aE\xdf\xa3": "video",
        b"BM": "bmp",
    }  # fmt: skip
    return next((name for mark, name in signatures.items() if head.startswith(mark)), None)


def read_header(path: Path, max_pixels: int = MAX_PIXELS) -> Header:
    """Return format and size without decoding a pixel.

    Raises:
        SourceError: The file is unreadable, of an unknown format, or too large.
    """
    kind = detect_format(path)
    if kind == "video":
        raise SourceError(f"{path}: is a video, not an image; to use it, give that file as path")
    try:
        width, height = _size(path, kind)
    except SourceError:
        raise
    except Exception as error:
        raise SourceError(f"{path}: broken {kind.upper()} file ({error})") from error
    check_size(path, width, height, max_pixels)
    return Header(kind, width, height)


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


def _size(path: Path, kind: str) -> tuple[int, int]:
    if kind == "png":
        head = read_bytes(path, 33)
        if len(head) < 33 or head[12:16] != b"IHDR":
            raise BrokenFileError("the file is truncated: it ends inside its header")
        return cast(tuple[int, int], struct.unpack_from(">II", head, 16))
    if kind == "gif":
        return cast(tuple[int, int], struct.unpack_from("<HH", read_bytes(path, 10), 6))
    if kind == "webp":
        return webp_size(read_bytes(path, 32))
    if kind == "exr":
        require_openexr(path)
        return exr_size(read_bytes(path, 1 << 16))
    from fire_atlas.sources.pillow import pillow_size

    return pillow_size(path, kind)


def webp_size(head: bytes) -> tuple[int, int]:
    """Return the size of a WebP from its first 30 bytes; Pillow would allocate the canvas first."""
    name, body = head[12:16], head[20:]
    if name == b"VP8X":
        return 1 + int.from_bytes(body[4:7], "little"), 1 + int.from_bytes(body[7:10], "little")
    if name == b"VP8L":
        bits = int.from_bytes(body[1:5], "little")
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    width, height = struct.unpack_from("<HH", body, 6)
    return width & 0x3FFF, height & 0x3FFF


def decode(path: Path, header: Header) -> Picture:
    """Return the picture in a still image file.

    Raises:
        SourceError: The file is cut short, damaged or animated, or its size is not the header's.
    """
    data = read_bytes(path)
    try:
        picture = decode_bytes(data, header.format)
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


def decode_bytes(data: bytes, kind: str) -> Picture:
    """Return the picture in the bytes of a still image of format ``kind``."""
    if kind == "png":
        return _decode_png(data)
    if kind == "exr":
        return finite_light(decode_exr(data))
    from fire_atlas.sources.pillow import decode_by_pillow, deep_tiff_samples

    if kind == "tiff" and (samples := deep_tiff_samples(data)) is not None:
        return _decode_deep_tiff(data, samples)
    return decode_by_pillow(data, kind)


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
    raw = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
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
