"""Write PNG fast: run-length encoding compresses flames as well as slower methods.

A page is cut into bands of rows, which are filtered (each row minus the one above) and deflated in
parallel. Each band ends with a full flush, so that the joined bands are one zlib stream, which does
not depend on the number of workers.

Compressed by libraries of our own requirements: the zlib inside Python is another one on Windows
and on some Linux, with other bytes.
"""

import io
import struct
from typing import Any, BinaryIO, NamedTuple

import deflate
import numpy as np
from numpy.typing import NDArray
from zlib_ng import zlib_ng

from fire_atlas.core.errors import OutputError
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.process import run_module
from fire_atlas.core.workers import Workers

_BAND_ROWS = 64
"""Rows in a band. Changing it changes the bytes of every page."""

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_RGBA, _GREY = 6, 0
_PERCEPTUAL_INTENT = b"\x00"
_ZLIB_HEADER = b"\x78\x01"
_FILTER_UP = 2
_ADLER_BASE = 65521


class _Band(NamedTuple):
    deflated: bytes
    adler: int
    length: int
    """Bytes before deflation."""


def write_png(
    file: BinaryIO, image: NDArray[Any], workers: Workers, *, is_data: bool = False
) -> None:
    """Write an (H, W, 4) RGBA image, uint8 or uint16, or one of heat, (H, W), band by band.

    ``is_data``: its values are no colours, and it states no colour space.
    """
    height, width = image.shape[:2]
    file.write(SIGNATURE)
    if image.ndim == 2:
        _write_size(file, width, height, 8, _GREY)
    elif is_data:
        _write_size(file, width, height, 8 * image.itemsize, _RGBA)
    else:
        write_header(file, width, height, 8 * image.itemsize)
    # The more significant byte of 16 bits comes first.
    image = np.ascontiguousarray(image, image.dtype.newbyteorder(">")).view(np.uint8)
    write_chunk(file, b"IDAT", _ZLIB_HEADER)
    adler = 1
    for band in workers.map(lambda top: _deflate_band(image, top), range(0, height, _BAND_ROWS)):
        write_chunk(file, b"IDAT", band.deflated)
        adler = _joined_adler(adler, band)
    write_chunk(file, b"IDAT", struct.pack(">I", adler))
    write_chunk(file, b"IEND", b"")


def write_header(file: BinaryIO, width: int, height: int, bits: int = 8) -> None:
    """Write the chunks that say what the pixels are: sRGB of some ``bits`` with straight alpha."""
    _write_size(file, width, height, bits, _RGBA)
    write_chunk(file, b"sRGB", _PERCEPTUAL_INTENT)


def _write_size(file: BinaryIO, width: int, height: int, bits: int, kind: int) -> None:
    described = bytes([bits, kind, 0, 0, 0])
    write_chunk(file, b"IHDR", struct.pack(">II", width, height) + described)


def compressed_pixels(image: Bytes) -> bytes:
    """Return the pixels of an (H, W, 4) uint8 RGBA image as one zlib stream, smaller than a page's
    and by one thread: for the frames of an animation."""
    return bytes(deflate.zlib_compress(_filtered(np.ascontiguousarray(image), 0, len(image)), 9))


def write_small_png(
    file: BinaryIO, image: NDArray[Any], workers: Workers, *, is_data: bool = False
) -> None:
    """Write an image as ``write_png`` does, optimised by oxipng, an optional dependency.

    Raises:
        OutputError: oxipng failed.
    """
    fast = io.BytesIO()
    write_png(fast, image, workers, is_data=is_data)
    done = run_module("fire_atlas.formats.pages.oxipng_process", fast.getvalue())
    if done.returncode:
        reason = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise OutputError(f"oxipng failed ({reason}); set atlas.compression to fast")
    file.write(done.stdout)


def _deflate_band(image: Bytes, top: int) -> _Band:
    rows = _filtered(image, top, _BAND_ROWS).data
    is_last = top + _BAND_ROWS >= image.shape[0]
    stream = zlib_ng.compressobj(1, zlib_ng.DEFLATED, -15, 9, zlib_ng.Z_RLE)
    deflated = stream.compress(rows)
    deflated += stream.flush(zlib_ng.Z_FINISH if is_last else zlib_ng.Z_FULL_FLUSH)
    return _Band(deflated, zlib_ng.adler32(rows), rows.nbytes)


def _filtered(image: Bytes, top: int, count: int) -> Bytes:
    """Return ``count`` rows from ``top`` on, filtered by PNG's Up: a byte, then a row's bytes."""
    flat = image.reshape(len(image), -1)
    band = flat[top : top + count]
    rows = np.empty((len(band), 1 + flat.shape[1]), np.uint8)
    rows[:, 0] = _FILTER_UP
    rows[0, 1:] = band[0] - flat[top - 1] if top else band[0]
    np.subtract(band[1:], band[:-1], out=rows[1:, 1:])
    return rows


def _joined_adler(adler: int, band: _Band) -> int:
    """Return the Adler-32 of all data up to and with ``band``, as zlib's adler32_combine."""
    low, high = adler & 0xFFFF, adler >> 16
    band_low, band_high = band.adler & 0xFFFF, band.adler >> 16
    joined_low = (low + band_low - 1) % _ADLER_BASE
    joined_high = (high + band_high + band.length * (low - 1)) % _ADLER_BASE
    return joined_high << 16 | joined_low


def write_chunk(file: BinaryIO, kind: bytes, data: bytes) -> None:
    """Write a chunk of a PNG: its length, kind, data and checksum."""
    file.write(struct.pack(">I", len(data)) + kind)
    file.write(data)
    file.write(struct.pack(">I", zlib_ng.crc32(data, zlib_ng.crc32(kind))))
