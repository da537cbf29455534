"""Split PNG files into chunks, check them, and write chunks."""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

from fire_atlas.sources.broken import BrokenFileError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
PIXEL_CHUNKS = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
"""The chunks that a decoder needs. Others (colour profiles, texts) make libpng print warnings."""


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
        if zlib.crc32(view[at + 4 : stop]) != struct.unpack_from(">I", data, stop)[0]:
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


def write_chunk(name: bytes, body: bytes) -> bytes:
    """Return the bytes of a chunk, with length and CRC."""
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))


def essential_chunks(data: bytes, found: list[Chunk]) -> bytes:
    """Return the PNG with only the chunks that a decoder needs."""
    kept = (data[c.start - 8 : c.stop + 4] for c in found if c.name in PIXEL_CHUNKS)
    return SIGNATURE + b"".join(kept)
