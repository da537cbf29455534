"""DDS files with the extended header of Direct3D 10, which names every BC format by its number.

Microsoft, "Programming Guide for DDS": the magic, DDS_HEADER, DDS_HEADER_DXT10, then the levels.
"""

import struct
from collections.abc import Sequence
from typing import BinaryIO

from fire_atlas.formats.textures.blocks import FORMATS
from fire_atlas.formats.textures.gpu_texture import AlphaMode, TextureHeader, level_sizes

_NUMBERS = {"bc1": (71, 72), "bc3": (77, 78), "bc4": (80, 80), "bc5": (83, 83), "bc7": (98, 99)}
"""DXGI_FORMAT of each format: sampled as it is, and decoded from sRGB."""

_FLAGS = 0x1 | 0x2 | 0x4 | 0x1000 | 0x20000 | 0x80000
"""The fields that are set: capabilities, height, width, pixel format, mip levels, linear size."""

_FOURCC, _TEXTURE_2D = 0x4, 3

_CAPS_TEXTURE, _CAPS_WITH_MIPS = 0x1000, 0x400000 | 0x8

_ALPHA_MODES: dict[AlphaMode, int] = {"straight": 1, "premultiplied": 2, "opaque": 3}

_HEAD = struct.Struct("<4s7I44x2I4s5I4I4x5I")


def write_dds(file: BinaryIO, header: TextureHeader, levels: Sequence[bytes]) -> None:
    """Write a texture whose levels, the largest first, are encoded."""
    caps = _CAPS_TEXTURE | (_CAPS_WITH_MIPS if len(levels) > 1 else 0)
    head = (b"DDS ", 124, _FLAGS, header.height, header.width, header.sizes[0], 1, len(levels))
    pixel_format = (32, _FOURCC, b"DX10", 0, 0, 0, 0, 0)
    number = _NUMBERS[header.format.name][header.srgb]
    extended = (number, _TEXTURE_2D, 0, 1, _ALPHA_MODES[header.alpha])
    file.write(_HEAD.pack(*head, *pixel_format, caps, 0, 0, 0, *extended))
    for level in levels:
        file.write(level)


def read_dds(data: bytes) -> TextureHeader:
    """Return what the bytes of a file say of their texture.

    Raises:
        ValueError: They are not a DDS file as this module writes them, or too few.
    """
    if len(data) < _HEAD.size:
        raise ValueError("it is too short for a DDS file")
    magic, _, _, height, width, _, _, levels, *rest = _HEAD.unpack_from(data)
    number, alpha = rest[-5], rest[-1]
    found = [(name, numbers) for name, numbers in _NUMBERS.items() if number in numbers]
    modes = [mode for mode, value in _ALPHA_MODES.items() if value == alpha]
    if magic != b"DDS " or rest[2] != b"DX10" or not found or not modes or not 1 <= levels <= 16:
        raise ValueError("it is no DDS file that fire-atlas wrote")
    name, numbers = found[0]
    sizes = level_sizes(FORMATS[name], width, height, levels)
    if len(data) != _HEAD.size + sum(sizes):
        raise ValueError(f"it has {len(data)} bytes instead of {_HEAD.size + sum(sizes)}")
    is_srgb = number == numbers[1] and numbers[0] != numbers[1]
    return TextureHeader(FORMATS[name], width, height, is_srgb, modes[0], sizes)
