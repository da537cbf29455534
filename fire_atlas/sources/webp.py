"""Find the frames of WebP files, and wrap each as a still WebP."""

import struct
from collections.abc import Iterator
from fractions import Fraction
from typing import BinaryIO

from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.patches import Disposal, EncodedAnimation, Patch

_ALPHA_FLAG, _EXIF_FLAG, _PROFILE_FLAG = 0x10, 0x08, 0x20
_MAX_HEAD_CHUNK = 16 << 20


def read_head(file: BinaryIO) -> tuple[tuple[int, int], bytes, bytes]:
    """Return the width and height, px, of a WebP as stored, its EXIF data, and its colour profile,
    both empty if its flags do not announce them. EXIF data follow the pixels."""
    start = file.read(30)
    flags = start[20] if start[12:16] == b"VP8X" else 0
    announced = {b"EXIF": flags & _EXIF_FLAG, b"ICCP": flags & _PROFILE_FLAG}
    found: dict[bytes, bytes] = {}
    while any(announced.values()) and len(head := file.read(8)) == 8:
        name, length = struct.unpack("<4sI", head)
        padded = length + (length & 1)
        if announced.get(name) and length <= _MAX_HEAD_CHUNK:
            found[name] = file.read(padded)[:length]
            announced[name] = 0
        else:
            file.seek(padded, 1)
    return _size(start), found.get(b"EXIF", b""), found.get(b"ICCP", b"")


def _size(head: bytes) -> tuple[int, int]:
    """Return the size by the first 30 bytes; Pillow would allocate the canvas first."""
    name, body = head[12:16], head[20:]
    if name == b"VP8X":
        return 1 + int.from_bytes(body[4:7], "little"), 1 + int.from_bytes(body[7:10], "little")
    if name == b"VP8L":
        bits = int.from_bytes(body[1:5], "little")
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    width, height = struct.unpack_from("<HH", body, 6)
    return width & 0x3FFF, height & 0x3FFF


def parse(data: bytes) -> EncodedAnimation:
    """Find the frames of a WebP without decoding them; a still WebP is one frame.

    Raises:
        BrokenFileError: The file is cut short.
    """
    if len(data) < 30:
        raise BrokenFileError("the file is truncated: it ends inside its header")
    promised = 8 + int.from_bytes(data[4:8], "little")
    if promised > len(data):
        raise BrokenFileError(
            f"the file is truncated: it has {len(data)} of the {promised} bytes its header states"
        )
    width, height = _size(data)
    found = list(_chunks(data, 12, promised))
    if not any(name == b"ANMF" for name, _, _ in found):
        still = Patch(0, 0, width, height, Fraction(), Disposal.KEEP, False, 0, promised)
        return EncodedAnimation("webp", width, height, [still], lambda _, raw: raw)
    patches = [_patch(data, start, stop) for name, start, stop in found if name == b"ANMF"]
    if any(p.x + p.width > width or p.y + p.height > height for p in patches):
        raise BrokenFileError("a frame exceeds the canvas")
    return EncodedAnimation("webp", width, height, patches, _wrap)


def _chunks(data: bytes, at: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """Yield name, start and stop of the chunks from ``at`` to ``end``; each has an even size."""
    while at + 8 <= end:
        length = int.from_bytes(data[at + 4 : at + 8], "little")
        start, stop = at + 8, at + 8 + length
        if stop > end:
            raise BrokenFileError(f"the file is damaged: the chunk at byte {at} runs past its end")
        yield data[at : at + 4], start, stop
        at = stop + (length & 1)


def _patch(data: bytes, start: int, stop: int) -> Patch:
    if stop - start < 24:
        raise BrokenFileError(f"the file is damaged: the frame at byte {start} is too short")
    half_x, half_y, less_width, less_height, milliseconds = (
        int.from_bytes(data[start + 3 * i : start + 3 * i + 3], "little") for i in range(5)
    )
    flags = data[start + 15]
    return Patch(
        2 * half_x, 2 * half_y, less_width + 1, less_height + 1,
        delay=Fraction(milliseconds, 1000),
        disposal=Disposal.CLEAR if flags & 1 else Disposal.KEEP,
        blend=not flags & 2,
        start=start + 16,
        stop=stop,
    )  # fmt: skip


def _wrap(patch: Patch, raw: bytes) -> bytes:
    """Return a still WebP: a header, and those chunks of the frame that a decoder needs."""
    known = (b"ALPH", b"VP8 ", b"VP8L")
    kept = [
        raw[a - 8 : b + (b - a & 1)] for name, a, b in _chunks(raw, 0, len(raw)) if name in known
    ]
    alpha = any(chunk[:4] in (b"ALPH", b"VP8L") for chunk in kept)
    canvas = struct.pack("<II", patch.width - 1, patch.height - 1)
    size = canvas[0:3] + canvas[4:7]
    head = b"VP8X" + struct.pack("<II", 10, _ALPHA_FLAG if alpha else 0) + size
    body = b"WEBP" + head + b"".join(kept)
    return b"RIFF" + struct.pack("<I", len(body)) + body
