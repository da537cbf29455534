"""Blocks of pixels that GPUs sample as they are, BC1, 3, 4, 5, 7, ETC2 and ASTC: formats, decoding.

Each block has a fixed number of bytes, whatever it shows.
"""

from dataclasses import dataclass

import numpy as np

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.astc import decode_astc
from fire_atlas.formats.textures.etc import decode_etc

_BAND_BLOCKS = 32
"""Rows of blocks that are decoded at a time."""


@dataclass(frozen=True, slots=True)
class BlockFormat:
    """How blocks of pixels are encoded.

    Attributes:
        name: ``bc7``, ``astc-6x6``, ...
        side: Width and height of a block, px.
        block_bytes: Size of a block.
        channels: Number of channels that a client reads.
    """

    name: str
    side: int
    block_bytes: int
    channels: int

    def level_bytes(self, width: int, height: int) -> int:
        """Return the size of an image in whole blocks."""
        return -(-width // self.side) * -(-height // self.side) * self.block_bytes


FORMATS = {
    format_.name: format_
    for format_ in (
        BlockFormat("bc1", 4, 8, 3),
        BlockFormat("bc3", 4, 16, 4),
        BlockFormat("bc4", 4, 8, 1),
        BlockFormat("bc5", 4, 16, 2),
        BlockFormat("bc7", 4, 16, 4),
        BlockFormat("astc-4x4", 4, 16, 4),
        BlockFormat("astc-5x5", 5, 16, 4),
        BlockFormat("astc-6x6", 6, 16, 4),
        BlockFormat("astc-8x8", 8, 16, 4),
        BlockFormat("etc2", 4, 16, 4),
        BlockFormat("eac-r11", 4, 8, 1),
        BlockFormat("eac-rg11", 4, 16, 2),
    )
}
"""All formats by name."""


def decode_blocks(
    data: bytes, width: int, height: int, format_: BlockFormat, srgb: bool, workers: Workers
) -> Bytes:
    """Return the pixels (H, W, 4) uint8 of blocks.

    Channels that a format lacks are 0, but alpha is 255.
    """
    across = -(-width // format_.side)
    band = _BAND_BLOCKS * across * format_.block_bytes

    def decode(start: int) -> Bytes:
        blocks = data[start : start + band]
        rows = len(blocks) // (across * format_.block_bytes) * format_.side
        return decode_whole(blocks, across * format_.side, rows, format_, srgb)

    return np.concatenate(list(workers.map(decode, range(0, len(data), band))))[:height, :width]


def decode_whole(data: bytes, width: int, height: int, format_: BlockFormat, srgb: bool) -> Bytes:
    """Return the pixels (H, W, 4) uint8 of whole blocks; see ``decode_blocks``."""
    if format_.name.startswith("astc"):
        return decode_astc(data, width, height, format_.side, srgb)
    found = _decoded(data, width, height, format_)
    if format_.channels == 4:
        return found
    pixels = np.zeros((height, width, 4), np.uint8)
    pixels[..., 3] = 255
    pixels[..., : format_.channels] = found[..., : format_.channels]
    return pixels


_PILLOW_BCN = {
    "bc1": ("RGBA", 1, "DXT1"),
    "bc3": ("RGBA", 3, "DXT5"),
    "bc4": ("L", 4, "BC4"),
    "bc5": ("RGB", 5, "BC5"),
    "bc7": ("RGBA", 7, "BC7"),
}
"""Mode of the image, and the number and name of the format, for Pillow's decoder."""


def _decoded(data: bytes, width: int, height: int, format_: BlockFormat) -> Bytes:
    """Return the pixels (H, W, channels) of whole blocks of BC or ETC."""
    if format_.name not in _PILLOW_BCN:
        return decode_etc(data, width, height, format_.channels)
    from PIL import Image

    mode, *names = _PILLOW_BCN[format_.name]
    decoded = np.asarray(Image.frombytes(mode, (width, height), data, "bcn", tuple(names)))
    return decoded.reshape(height, width, -1)
