"""Encode images as blocks of pixels that GPUs sample as they are: BC1, 3, 4, 5, 7, ETC2 and ASTC.

Each block has a fixed number of bytes, whatever it shows. The encoders are packages of the extra
``gpu``; they release the interpreter's lock, so rows of blocks are encoded in the pool.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.etc import decode_etc

_BAND_BLOCKS = 32
"""Rows of blocks that are encoded at a time."""

_BC7_EFFORT = 2
"""Of 4. With all partitions tried, 1 loses 0.1 dB on fire in two thirds of the time; 4 gains 0.02
in a third more."""

_NO_COVER = 1e-2
"""Mean alpha, of 255, up to which a neighbourhood is empty: sums in float32 may not be 0 there."""

_ASTC_QUALITY = 80.0
"""Of 100, between astcenc's "medium" (60) and "thorough" (98). 60 loses 0.2 to 1.5 dB on fire in
half the time; 98 gains 0.1 to 0.4 in up to twice the time."""


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


def encode_blocks(
    image: Bytes,
    format_: BlockFormat,
    srgb: bool,
    workers: Workers,
    *,
    has_straight_colour: bool = False,
) -> bytes:
    """Return the blocks of an image (H, W, 4) uint8, row by row; pixels beyond it repeat its edge.

    Args:
        image: The pixels. Of a format of fewer channels, the first ones are encoded.
        format_: How blocks are encoded.
        srgb: Whether a GPU decodes colours from sRGB as it samples them.
        workers: Encode bands of rows.
        has_straight_colour: Whether alpha says how much is seen of the colour: less is then spent
            on colour that hardly shows.
    """
    height, width = image.shape[:2]
    across, down = -width % format_.side, -height % format_.side
    whole = np.pad(image, ((0, down), (0, across), (0, 0)), mode="edge")
    rows = _BAND_BLOCKS * format_.side

    def encode(top: int) -> bytes:
        band = np.ascontiguousarray(whole[top : top + rows])
        if has_straight_colour:
            band = _with_even_colour(band, format_.side)
        if format_.name.startswith("astc"):
            return _astc(band, format_, srgb, has_straight_colour)
        return _by_etcpak(band, format_)

    return b"".join(workers.map(encode, range(0, len(whole), rows)))


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
        size = across * format_.side, rows
        if format_.name.startswith("astc"):
            return _astc_decoded(blocks, *size, format_, srgb)
        return _in_four_channels(_decoded(blocks, *size, format_), format_.channels)

    return np.concatenate(list(workers.map(decode, range(0, len(data), band))))[:height, :width]


def _with_even_colour(image: Bytes, side: int) -> Bytes:
    """Return pixels (H, W, 4) whose straight colours vary less where they hardly show.

    Each colour moves towards the mean of those within half a block, weighted by their alpha, as
    far as its premultiplied value allows that stays the same but for rounding. Where alpha is low,
    straight colours are mostly such rounding, and blocks would spend their bits on it.
    """
    colour, alpha = image[..., :3].astype(np.float32), image[..., 3:].astype(np.float32)
    window = (side // 2 * 2 + 1,) * 2
    sums = cv2.blur(np.dstack([colour * alpha, alpha]), window, borderType=cv2.BORDER_REPLICATE)
    cover = sums[..., 3:]
    mean = np.divide(sums[..., :3], cover, out=colour.copy(), where=cover > _NO_COVER)
    reach = np.floor(127.5 / np.maximum(alpha, 0.5))
    even = np.rint(np.clip(mean, colour - reach, colour + reach))
    return np.dstack([even.clip(0, 255).astype(np.uint8), image[..., 3]])


_ETCPAK = {"etc2": "etc2_rgba", "eac-r11": "eac_r", "eac-rg11": "eac_rg"}
"""What etcpak calls a format, if by another name."""


def _by_etcpak(image: Bytes, format_: BlockFormat) -> bytes:
    """Encode whole blocks by etcpak; BC7 with equal weights, not for the eye: alpha counts too."""
    import etcpak

    height, width = image.shape[:2]
    if format_.name == "bc7":
        settings = etcpak.BC7CompressBlockParams()
        settings.init_linear_weights()
        settings.m_uber_level = _BC7_EFFORT
        settings.m_mode17_partition_estimation_filterbank = False
        return etcpak.compress_bc7(image.tobytes(), width, height, settings)
    encode = getattr(etcpak, f"compress_{_ETCPAK.get(format_.name, format_.name)}")
    # Of EAC R11 it returns twice as many bytes; those of the second half mean nothing.
    return bytes(encode(image.tobytes(), width, height)[: format_.level_bytes(width, height)])


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


def _in_four_channels(image: Bytes, channels: int) -> Bytes:
    whole = np.zeros((*image.shape[:2], 4), np.uint8)
    whole[..., 3] = 255
    whole[..., :channels] = image[..., :channels]
    return whole


def _astc(image: Bytes, format_: BlockFormat, srgb: bool, has_straight_colour: bool) -> bytes:
    """Encode whole blocks by astcenc; errors of straight colours count by their alpha."""
    from astc_encoder import ASTCConfigFlags, ASTCSwizzle

    flags = int(ASTCConfigFlags.USE_APLHA_WEIGHT) if has_straight_colour else 0
    picture = _astc_image(image.shape[1], image.shape[0], image)
    return bytes(_astc_context(format_, srgb, flags).compress(picture, ASTCSwizzle()))


def _astc_decoded(data: bytes, width: int, height: int, format_: BlockFormat, srgb: bool) -> Bytes:
    import astc_encoder

    empty = _astc_image(width, height, np.zeros((height, width, 4), np.uint8))
    context = _astc_context(format_, srgb)
    decoded = context.decompress(data, empty, astc_encoder.ASTCSwizzle()).data
    return np.frombuffer(decoded, np.uint8).reshape(height, width, 4)


def _astc_image(width: int, height: int, image: NDArray[np.uint8]) -> Any:
    from astc_encoder import ASTCImage, ASTCType

    return ASTCImage(ASTCType.U8, width, height, 1, image.tobytes())


def _astc_context(format_: BlockFormat, srgb: bool, flags: int = 0) -> Any:
    """Return what encodes and decodes blocks, in one thread: it must not be shared by several."""
    from astc_encoder import ASTCConfig, ASTCContext, ASTCProfile

    profile = ASTCProfile.LDR_SRGB if srgb else ASTCProfile.LDR
    side = format_.side
    return ASTCContext(ASTCConfig(profile, side, side, 1, _ASTC_QUALITY, flags), threads=1)
