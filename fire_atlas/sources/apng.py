"""Find the frames of PNG and APNG files, and wrap each as a still PNG."""

import struct
from fractions import Fraction

from fire_atlas.sources import png
from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.patches import Disposal, EncodedAnimation, Patch
from fire_atlas.sources.png import Chunk

_DISPOSALS = (Disposal.KEEP, Disposal.CLEAR, Disposal.RESTORE)


def parse(data: bytes) -> EncodedAnimation:
    """Find the frames of an APNG without decoding them; a plain PNG is one frame.

    Raises:
        BrokenFileError: The file is cut short or damaged, or contradicts its own header.
    """
    found = list(png.chunks(data))
    if not found or found[0].name != b"IHDR" or found[0].stop - found[0].start != 13:
        raise BrokenFileError("the file does not begin with a PNG header")
    head = data[found[0].start : found[0].stop]
    width, height = struct.unpack_from(">II", head)
    shared = b"".join(data[c.start - 8 : c.stop + 4] for c in found if c.name in (b"PLTE", b"tRNS"))

    def wrap(patch: Patch, raw: bytes) -> bytes:
        size = struct.pack(">II", patch.width, patch.height)
        pixels = png.write_chunk(b"IDAT", _pixel_data(raw))
        return b"".join(
            [png.SIGNATURE, png.write_chunk(b"IHDR", size + head[8:]), shared, pixels,
             png.write_chunk(b"IEND", b"")]
        )  # fmt: skip

    patches = _patches(data, found, (width, height))
    return EncodedAnimation("png", width, height, patches, wrap)


def _patches(data: bytes, found: list[Chunk], size: tuple[int, int]) -> list[Patch]:
    """Return a patch for each fcTL chunk; its data end at the next one."""
    controls = [c for c in found if c.name == b"fcTL"]
    frame_count = png.stated_frame_count(data, found)
    if not any(c.name == b"acTL" for c in found):
        pixels = [c for c in found if c.name == b"IDAT"]
        if not pixels:
            raise BrokenFileError("the file holds no pixels (no IDAT chunk)")
        start, stop = pixels[0].start - 8, pixels[-1].stop + 4
        return [Patch(0, 0, *size, Fraction(), Disposal.KEEP, False, start, stop)]
    if len(controls) != frame_count:
        raise BrokenFileError(
            f"its header states {frame_count} frames, but it holds {len(controls)}"
        )
    ends = [c.start - 8 for c in controls[1:]] + [found[-1].start - 8]
    return [_patch(data, control, end, size) for control, end in zip(controls, ends, strict=True)]


def _patch(data: bytes, control: Chunk, stop: int, size: tuple[int, int]) -> Patch:
    if control.stop - control.start != 26:
        raise BrokenFileError("a frame's control chunk has the wrong length")
    _, width, height, x, y, top, bottom, disposal, blend = struct.unpack_from(
        ">IIIIIHHBB", data, control.start
    )
    if x + width > size[0] or y + height > size[1]:
        raise BrokenFileError(f"a frame of {width}x{height} at {x},{y} exceeds the canvas")
    return Patch(
        x, y, width, height,
        delay=Fraction(top, bottom or 100),
        disposal=_DISPOSALS[disposal] if disposal < 3 else Disposal.KEEP,
        blend=blend == 1,
        start=control.stop + 4,
        stop=stop,
    )  # fmt: skip


def _pixel_data(raw: bytes) -> bytes:
    """Join the compressed pixels of the IDAT or fdAT chunks in ``raw``, whose CRCs are checked."""
    parts, at = [], 0
    while at < len(raw):
        length, name = struct.unpack_from(">I4s", raw, at)
        body = raw[at + 8 : at + 8 + length]
        if name in (b"IDAT", b"fdAT"):
            # An fdAT begins with its sequence number.
            parts.append(body if name == b"IDAT" else body[4:])
        at += 12 + length
    return b"".join(parts)
