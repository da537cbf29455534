"""DDS files: of BC1 and BC3 with the header that every reader knows, of other formats and of sRGB
with the extended header of Direct3D 10, which names every BC format by its number.

Microsoft, "Programming Guide for DDS": the magic, DDS_HEADER, DDS_HEADER_DXT10, then the levels.
"""

import struct
from collections.abc import Sequence
from typing import BinaryIO

from fire_atlas.formats.textures.blocks import FORMATS
from fire_atlas.formats.textures.gpu_texture import AlphaMode, TextureHeader, level_sizes

_CODES = {"bc1": b"DXT1", "bc3": b"DXT5"}
"""FourCC of formats that Direct3D 9 had. Its "DXT4", premultiplied BC3, no reader knows."""

_NUMBERS = {"bc1": (71, 72), "bc3": (77, 78), "bc4": (80, 80), "bc5": (83, 83), "bc7": (98, 99)}
"""DXGI_FORMAT of each format: sampled as it is, and decoded from sRGB."""

_FLAGS = 0x1 | 0x2 | 0x4 | 0x1000 | 0x20000 | 0x80000
"""The fields that are set: capabilities, height, width, pixel format, mip levels, linear size."""

_FOURCC, _TEXTURE_2D = 0x4, 3

_CAPS_TEXTURE, _CAPS_WITH_MIPS = 0x1000, 0x400000 | 0x8

_ALPHA_MODES: dict[AlphaMode, int] = {"straight": 1, "premultiplied": 2, "opaque": 3}

_HEAD, _EXTENDED = struct.Struct("<4s7I44x2I4s5I4I4x"), struct.Struct("<5I")


def write_dds(file: BinaryIO, header: TextureHeader, levels: Sequence[bytes]) -> None:
    """Write a texture whose levels, the largest first, are encoded."""
    code = b"DX10" if header.srgb else _CODES.get(header.format.name, b"DX10")
    caps = _CAPS_TEXTURE | (_CAPS_WITH_MIPS if len(levels) > 1 else 0)
    head = (b"DDS ", 124, _FLAGS, header.height, header.width, header.sizes[0], 1, len(levels))
    pixel_format = (32, _FOURCC, code, 0, 0, 0, 0, 0)
    file.write(_HEAD.pack(*head, *pixel_format, caps, 0, 0, 0))
    if code == b"DX10":
        number = _NUMBERS[header.format.name][header.srgb]
        file.write(_EXTENDED.pack(number, _TEXTURE_2D, 0, 1, _ALPHA_MODES[header.alpha]))
    for level in levels:
        file.write(level)


def read_dds(data: bytes) -> TextureHeader:
    """Return what the bytes of a file say of their texture.

    Raises:
        ValueError: They are not a DDS file as this module writes them, or too few.
    """
    if len(data) < _HEAD.size:
        raise ValueError("it is too short for a DDS file")
    magic, _, _, height, width, _, _, levels, _, _, code, *_ = _HEAD.unpack_from(data)
    name, is_srgb, alpha, begin = _named(code, data[_HEAD.size :])
    if magic != b"DDS " or not 1 <= levels <= 16:
        raise ValueError("it is no DDS file that fire-atlas wrote")
    sizes = level_sizes(FORMATS[name], width, height, levels)
    if len(data) != begin + sum(sizes):
        raise ValueError(f"it has {len(data)} bytes instead of {begin + sum(sizes)}")
    return TextureHeader(FORMATS[name], width, height, is_srgb, alpha, sizes)


def _named(code: bytes, rest: bytes) -> tuple[str, bool, AlphaMode, int]:
    """Return the name of a format, whether it is sRGB, its alpha, and where the levels begin.

    Args:
        code: FourCC of the file.
        rest: What follows its first header.

    Raises:
        ValueError: This module writes no such file.
    """
    for name, old in _CODES.items():
        if code == old:
            return name, False, "unstated", _HEAD.size
    if code == b"DX10" and len(rest) >= _EXTENDED.size:
        number, *_, mode = _EXTENDED.unpack_from(rest)
        for name, (plain, srgb) in _NUMBERS.items():
            for alpha, value in _ALPHA_MODES.items():
                if number in {plain, srgb} and mode == value:
                    return name, number != plain, alpha, _HEAD.size + _EXTENDED.size
    raise ValueError("it is no DDS file that fire-atlas wrote")
