"""Split PNG files into chunks, check them, and write chunks."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import deflate
from zlib_ng import zlib_ng

from fire_atlas.sources.broken import BrokenFileError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_SAMPLES = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Samples of a pixel, by the number of the colour type."""

_LEAST_DATA = 1 << 16
"""Bytes of compressed pixels that a picture of any size may have."""

_MOST_INFLATED = 32 << 20
"""Bytes of pixels, with their filters, that are inflated before a picture is decoded: of larger
ones that would take memory."""

PIXEL_CHUNKS = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
"""The chunks that a decoder needs. Others (colour profiles, texts) make libpng print warnings."""

_HEAD_CHUNKS = (b"iCCP", b"cICP", b"sRGB", b"gAMA", b"cHRM", b"eXIf")
_MAX_HEAD_CHUNK = 16 << 20


@dataclass(frozen=True, slots=True)
class Head:
    """What a PNG says about its picture.

    Attributes:
        width, height: Size as stored, px.
        bits: Bits of a sample.
        has_colour: False if it is grey.
        chunks: Those about colours and EXIF data, by name. They are not checked.
    """

    width: int
    height: int
    bits: int
    has_colour: bool
    chunks: dict[bytes, bytes]


def read_head(file: BinaryIO) -> Head:
    """Read what a PNG says about its picture. EXIF data may follow the pixels.

    Raises:
        BrokenFileError: It ends inside its header. What else is broken, ``chunks`` finds.
    """
    start = file.read(33)
    if len(start) < 33 or start[12:16] != b"IHDR":
        raise BrokenFileError("the file is truncated: it ends inside its header")
    width, height, bits, kind = struct.unpack_from(">IIBB", start, 16)
    found: dict[bytes, bytes] = {}
    while len(head := file.read(8)) == 8:
        length, name = struct.unpack(">I4s", head)
        if name == b"IEND":
            break
        if name in _HEAD_CHUNKS and length <= _MAX_HEAD_CHUNK:
            found.setdefault(name, file.read(length))
            file.seek(4, 1)
        else:
            file.seek(length + 4, 1)
    return Head(width, height, bits, kind not in (0, 4), found)


@dataclass(frozen=True, slots=True)
class Chunk:
    """One PNG chunk: its four-letter name and the range of its data in the file, bytes."""

    name: bytes
    start: int
    stop: int


def chunks(data: bytes) -> Iterator[Chunk]:
    """Yield every chunk up to IEND, each checked against its CRC.

    Raises:
        BrokenFileError: The file ends early or a chunk is damaged.
    """
    at = len(SIGNATURE)
    view = memoryview(data)
    while True:
        if at + 12 > len(data):
            raise BrokenFileError(
                f"the file is truncated: it ends at byte {len(data)} without IEND"
            )
        length, name = struct.unpack_from(">I4s", data, at)
        start, stop = at + 8, at + 8 + length
        if stop + 4 > len(data):
            text = name.decode("latin-1")
            raise BrokenFileError(f"the file is truncated: it ends inside its {text} chunk")
        if zlib_ng.crc32(view[at + 4 : stop]) != struct.unpack_from(">I", data, stop)[0]:
            raise BrokenFileError(f"the {name.decode('latin-1')} chunk at byte {at} is damaged")
        yield Chunk(name, start, stop)
        if name == b"IEND":
            return
        at = stop + 4


def stated_frame_count(data: bytes, found: list[Chunk]) -> int:
    """Return the number of APNG frames that the chunk acTL states; 1 for a plain PNG."""
    for chunk in found:
        if chunk.name == b"acTL" and chunk.stop - chunk.start >= 8:
            return int(struct.unpack_from(">I", data, chunk.start)[0])
    return 1


def write_chunk(name: bytes, body: bytes | bytearray) -> bytes:
    """Return the bytes of a chunk, with length and CRC."""
    crc = zlib_ng.crc32(body, zlib_ng.crc32(name))
    return b"".join((struct.pack(">I", len(body)), name, body, struct.pack(">I", crc)))


def essential_chunks(data: bytes, found: list[Chunk]) -> bytes:
    """Return the PNG with only the chunks that a decoder needs, and its pixels stored as they are.

    Raises:
        BrokenFileError: It has more compressed data than a picture of its size can need.
    """
    width, height, bits, kind = struct.unpack_from(">IIBB", data, len(SIGNATURE) + 8)
    stored = sum(c.stop - c.start for c in found if c.name == b"IDAT")
    # Twice the picture: what deflate cannot press grows a little, and so do interlaced rows.
    most = 2 * height * (1 + width * bits * _SAMPLES.get(kind, 4) // 8) + _LEAST_DATA
    if stored > most:
        raise BrokenFileError(
            f"it holds {stored} bytes of compressed pixels, and {width}x{height} of them need at "
            f"most {most}"
        )
    pixels = b"".join(data[c.start : c.stop] for c in found if c.name == b"IDAT")
    kept = [SIGNATURE]
    for chunk in found:
        if chunk.name != b"IDAT" and chunk.name in PIXEL_CHUNKS:
            kept.append(data[chunk.start - 8 : chunk.stop + 4])
        elif chunk.name == b"IDAT" and pixels:
            kept.append(write_chunk(b"IDAT", _inflated(pixels, min(most, _MOST_INFLATED))))
            pixels = b""
    return b"".join(kept)


def _inflated(pixels: bytes, most: int) -> bytes | bytearray:
    """Return a zlib stream as one that holds the same bytes uncompressed.

    OpenCV inflates by the system's zlib, which takes five times as long as libdeflate: of a picture
    of 640 x 640, 4 ms and not .8. A stream that is broken, or holds more than ``most`` bytes, is
    returned as it is.
    """
    try:
        return deflate.zlib_compress(deflate.zlib_decompress(pixels, most), 0)
    except deflate.DeflateError:
        return pixels
