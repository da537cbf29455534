"""KTX 2.0 files: a header, the index of levels, the data format descriptor, keys, then the levels.

Khronos, "KTX File Format Specification" 2.0 and "Khronos Data Format Specification" 1.3.
"""

import math
import struct
from collections.abc import Sequence
from typing import BinaryIO

from fire_atlas.core.version import __version__
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.blocks import FORMATS, BlockFormat
from fire_atlas.formats.textures.gpu_texture import AlphaMode, TextureHeader, level_sizes
from fire_atlas.recipe.gpu import Supercompression

_MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
_HEAD = struct.Struct("<12s9I4I2Q")
_LEVEL = struct.Struct("<3Q")

_NUMBERS = {
    "bc1": (131, 132), "bc3": (137, 138), "bc4": (139, 139), "bc5": (141, 141), "bc7": (145, 146),
    "astc-4x4": (157, 158), "astc-5x5": (161, 162), "astc-6x6": (165, 166),
    "astc-8x8": (171, 172), "etc2": (151, 152), "eac-r11": (153, 153), "eac-rg11": (155, 155),
}  # fmt: skip
"""VkFormat of each format: sampled as it is, and decoded from sRGB. BC1 is that without alpha."""

_MODELS = {
    "bc1": 128, "bc3": 130, "bc4": 131, "bc5": 132, "bc7": 134, "etc2": 161, "eac": 161,
    "astc": 162,
}  # fmt: skip
"""Colour model of each format in the data format descriptor (KHR_DF_MODEL_...)."""

_SCHEMES: dict[Supercompression, int] = {"none": 0, "zstd": 2}
"""Number of each supercompression scheme."""

_ZSTD_FAST, _ZSTD_SMALL = 3, 19
"""Levels of Zstandard, of 22. On 12 MB of fire 19 takes 1 to 5 s, 60 times as long as 3, and makes
a tenth to a third less; beyond it readers need more memory."""

_BT709, _LINEAR, _SRGB, _PREMULTIPLIED = 1, 1, 2, 1
_ETC2_COLOUR, _ALPHA_CHANNEL, _LINEAR_SAMPLE = 2, 15, 0x10

_WRITER = f"fire-atlas {__version__}"


def write_ktx2(file: BinaryIO, header: TextureHeader, levels: Sequence[bytes]) -> None:
    """Write a texture whose levels, the largest first, are encoded, and supercompressed if its
    header says so; the smallest comes first."""
    descriptor = _descriptor(header)
    keys = _entry("KTXorientation", "rd") + _entry("KTXwriter", _WRITER)
    start = _HEAD.size + _LEVEL.size * len(levels)
    number = _NUMBERS[header.format.name][header.srgb]
    shape = (number, 1, header.width, header.height, 0, 0, 1, len(levels))
    scheme = _SCHEMES[header.supercompression]
    index = (start, len(descriptor), start + len(descriptor), len(keys), 0, 0)
    align = 1 if scheme else math.lcm(header.format.block_bytes, 4)
    end, places, padding = start + len(descriptor) + len(keys), dict[int, int](), dict[int, int]()
    for level in reversed(range(len(levels))):
        padding[level] = -end % align
        places[level] = end + padding[level]
        end = places[level] + len(levels[level])
    file.write(_HEAD.pack(_MAGIC, *shape, scheme, *index))
    for level, data in enumerate(levels):
        file.write(_LEVEL.pack(places[level], len(data), header.sizes[level]))
    file.write(descriptor + keys)
    for level in reversed(range(len(levels))):
        file.write(bytes(padding[level]) + levels[level])


def supercompressed(levels: Sequence[bytes], is_final: bool, workers: Workers) -> list[bytes]:
    """Return each level compressed by Zstandard, in full if it is final."""
    from zstandard import ZstdCompressor

    effort = _ZSTD_SMALL if is_final else _ZSTD_FAST
    return list(workers.map(lambda data: ZstdCompressor(effort).compress(data), levels))


def _entry(key: str, value: str) -> bytes:
    """Return an entry of the keys and values: its length, both with a final 0, and padding."""
    entry = f"{key}\0{value}\0".encode()
    return struct.pack("<I", len(entry)) + entry + bytes(-len(entry) % 4)


def _descriptor(header: TextureHeader) -> bytes:
    """Return the data format descriptor: transfer function, alpha, blocks and their parts."""
    name, side = header.format.name, header.format.side
    samples = _samples(header.format, header.srgb)
    colours = (
        _MODELS[name.partition("-")[0]],
        _BT709,
        _SRGB if header.srgb else _LINEAR,
        _PREMULTIPLIED if header.alpha == "premultiplied" else 0,
    )
    size = 24 + len(samples)
    block = struct.pack("<I2H4B4B8B", 0, 2, size, *colours, side - 1, side - 1, 0, 0,
                        header.format.block_bytes, *(0,) * 7)  # fmt: skip
    return struct.pack("<I", size + 4) + block + samples


def _samples(format_: BlockFormat, srgb: bool) -> bytes:
    """Return the parts of a block: alpha and colours, red and green, or one."""
    bits = format_.block_bytes * 8
    if format_.name in ("bc3", "etc2"):
        alpha = _ALPHA_CHANNEL | (_LINEAR_SAMPLE if srgb else 0)
        return _sample(0, 64, alpha) + _sample(64, 64, _ETC2_COLOUR * (format_.name == "etc2"))
    if format_.name in ("bc5", "eac-rg11"):
        return _sample(0, 64, 0) + _sample(64, 64, 1)
    return _sample(0, bits, 0)


def _sample(offset: int, bits: int, channel: int) -> bytes:
    return struct.pack("<H2B4B2I", offset, bits - 1, channel, 0, 0, 0, 0, 0, 0xFFFFFFFF)


def read_ktx2(data: bytes) -> TextureHeader:
    """Return what the bytes of a file say of their texture.

    Raises:
        ValueError: They are not a KTX2 file as this module writes them, or too few.
    """
    if len(data) < _HEAD.size:
        raise ValueError("it is too short for a KTX2 file")
    magic, number, _, width, height, _, _, _, levels, scheme, descriptor, *_ = _HEAD.unpack_from(
        data
    )
    packing = [name for name, number in _SCHEMES.items() if number == scheme]
    found = [(name, numbers) for name, numbers in _NUMBERS.items() if number in numbers]
    is_known = magic == _MAGIC and found and packing
    if not is_known or not 1 <= levels <= 16 or descriptor + 16 > len(data):
        raise ValueError("it is no KTX2 file that fire-atlas wrote")
    name, numbers = found[0]
    sizes = level_sizes(FORMATS[name], width, height, levels)
    _refuse_cut_off(data, sizes, packing[0])
    is_srgb = number == numbers[1] and numbers[0] != numbers[1]
    alpha = _alpha(data, descriptor, name)
    return TextureHeader(FORMATS[name], width, height, is_srgb, alpha, sizes, packing[0])


def _alpha(data: bytes, descriptor: int, name: str) -> AlphaMode:
    if FORMATS[name].channels < 4:
        return "opaque"
    return "premultiplied" if data[descriptor + 15] & _PREMULTIPLIED else "straight"


def _refuse_cut_off(data: bytes, sizes: Sequence[int], packing: Supercompression) -> None:
    """Refuse a file whose levels are not where its index says, in full."""
    if len(data) < _HEAD.size + _LEVEL.size * len(sizes):
        raise ValueError("it is too short for its levels")
    for level, size in enumerate(sizes):
        place, length, unpacked = _LEVEL.unpack_from(data, _HEAD.size + level * _LEVEL.size)
        is_whole = unpacked == size and (packing != "none" or length == size)
        if not is_whole or place + length > len(data):
            raise ValueError(f"its level {level} is not {size} bytes in the file")
