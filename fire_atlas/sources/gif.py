"""Find the frames of GIF files, and wrap each as a still GIF.

Many GIFs break the rules of their format in ways that no browser minds. These are played as
browsers do, and ``EncodedAnimation.notes`` says so: files without a trailer, zero bytes between
blocks, frames that reach beyond the screen, and a first one that is larger than it.
"""

import struct
from dataclasses import replace
from fractions import Fraction

from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.patches import Disposal, EncodedAnimation, Patch

_EXTENSION, _IMAGE, _TRAILER, _CONTROL = 0x21, 0x2C, 0x3B, 0xF9
_NO_CONTROL = bytes(4)
_DISPOSALS = {2: Disposal.CLEAR, 3: Disposal.RESTORE}


def parse(data: bytes) -> EncodedAnimation:
    """Find the frames of a GIF without decoding them.

    Raises:
        BrokenFileError: The file is cut short inside a frame, or a block does not begin as one.
    """
    if len(data) < 13:
        raise BrokenFileError("the file is truncated: it ends inside its header")
    width, height, flags = struct.unpack_from("<HHB", data, 6)
    screen = data[10:13]
    colours = data[13 : 13 + _table_bytes(flags)]
    try:
        patches, notes = _patches(data, 13 + len(colours))
    except (IndexError, struct.error):
        raise BrokenFileError(f"the file is truncated: it ends at byte {len(data)}") from None
    if patches and (patches[0].width > width or patches[0].height > height):
        notes.append(
            f"its screen of {width}x{height} is made as large as its first frame, as in browsers"
        )
        width, height = patches[0].width, patches[0].height
        patches[0] = replace(patches[0], x=0, y=0)
    if beyond := sum(p.x + p.width > width or p.y + p.height > height for p in patches):
        notes.append(
            f"{beyond} of its {len(patches)} frames reach beyond its screen of {width}x{height}; "
            "what is outside is left out, as in browsers"
        )

    def wrap(patch: Patch, raw: bytes) -> bytes:
        size = struct.pack("<HH", patch.width, patch.height)
        control = b"\x21\xf9\x04" + patch.extra + b"\0"
        at_origin = raw[:1] + bytes(4) + raw[5:]  # x and y of the image set to 0
        return b"GIF89a" + size + screen + colours + control + at_origin + b"\x3b"

    return EncodedAnimation("gif", width, height, patches, wrap, tuple(notes))


def _table_bytes(flags: int) -> int:
    return 3 << ((flags & 7) + 1) if flags & 0x80 else 0


def _patches(data: bytes, at: int) -> tuple[list[Patch], list[str]]:
    """Return the frames, and notes on what lies between them and after them."""
    patches: list[Patch] = []
    control, padding, notes = None, 0, list[str]()
    # A control block announces a frame: a file that ends after one has lost it.
    while (control is not None or at < len(data)) and data[at] != _TRAILER:
        if data[at] == _EXTENSION:
            if data[at + 1] == _CONTROL and data[at + 2] == 4:
                control = data[at + 3 : at + 7]
            at = _after_blocks(data, at + 2)
        elif data[at] == _IMAGE:
            stop = _after_blocks(data, at + 11 + _table_bytes(data[at + 9]))
            patches.append(_patch(data, at, stop, control or _NO_CONTROL))
            control, at = None, stop
        elif data[at] == 0:
            padding, at = padding + 1, at + 1
        else:
            raise BrokenFileError(f"byte {at} should begin a block, but is 0x{data[at]:02x}")
    if not patches:
        return patches, notes
    if padding:
        notes.append(f"{padding} zero bytes between its blocks are skipped")
    if at >= len(data):
        whole = "frame is whole" if len(patches) == 1 else f"{len(patches)} frames are whole"
        notes.append(f"it ends without a trailer, perhaps too early; its {whole}")
    return patches, notes


def _after_blocks(data: bytes, at: int) -> int:
    """Return the offset after a chain of length-prefixed sub-blocks, which ends with length 0."""
    while length := data[at]:
        at += 1 + length
    return at + 1


def _patch(data: bytes, start: int, stop: int, control: bytes) -> Patch:
    x, y, width, height = struct.unpack_from("<HHHH", data, start + 1)
    flags, hundredths = struct.unpack_from("<BH", control)
    return Patch(
        x, y, width, height,
        delay=Fraction(hundredths, 100),
        disposal=_DISPOSALS.get(flags >> 2 & 7, Disposal.KEEP),
        blend=True,
        start=start,
        stop=stop,
        extra=bytes([flags & 1, 0, 0, control[3]]),
    )  # fmt: skip
