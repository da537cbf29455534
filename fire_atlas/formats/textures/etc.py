"""Decode ETC2 and EAC blocks, of 4 × 4 px.

Khronos, "Khronos Data Format Specification" 1.3, chapters 21 (ETC2) and 21.5 (EAC). Of several
channels, blocks of 64 bits follow one another: alpha and colour, or red and green. The pixels of a
block are numbered column by column.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import Bytes

_Ints: TypeAlias = NDArray[np.int64]
_Words: TypeAlias = NDArray[np.uint64]

_EAC_MODIFIERS = np.array([
    [3, 6, 9, 15], [3, 7, 10, 13], [2, 5, 8, 13], [2, 4, 6, 13],
    [3, 6, 8, 12], [3, 7, 9, 11], [4, 7, 8, 11], [3, 5, 8, 11],
    [2, 6, 8, 10], [2, 5, 8, 10], [2, 4, 8, 10], [2, 5, 7, 10],
    [3, 4, 7, 10], [1, 2, 3, 10], [4, 6, 8, 9], [3, 5, 7, 9],
])  # fmt: skip
"""Table of modifiers: a pixel's index 0-3 stands for −value, 4-7 for value − 1."""

_MODIFIERS = np.array(
    [[2, 8], [5, 17], [9, 29], [13, 42], [18, 60], [24, 80], [33, 106], [47, 183]]
)
"""Small and large modifier of each table of ETC1."""

_DISTANCES = np.array([3, 6, 11, 16, 23, 32, 41, 64])
"""Distances of modes T and H."""

_X, _Y = np.divmod(np.arange(16), 4)
"""Place of each pixel in its block."""


def decode_etc(data: bytes, width: int, height: int, channels: int) -> Bytes:
    """Return the pixels (H, W, channels) of blocks.

    Args:
        data: Blocks of EAC R11 (1 channel), EAC RG11 (2) or ETC2 with EAC alpha (4), row by row.
        width, height: Size of the image, whole blocks, px.
        channels: Number of channels, which is that of the format.
    """
    words = np.frombuffer(data, ">u8").astype(np.uint64)
    if channels == 4:
        pixels = np.dstack([_colours(words[1::2]), _alpha(words[::2])])
    else:
        pixels = np.dstack([_eleven_bits(words[i::channels]) for i in range(channels)])
    blocks = pixels.reshape(height // 4, width // 4, 4, 4, channels)  # rows, columns, x, y
    return blocks.transpose(0, 3, 1, 2, 4).reshape(height, width, channels).astype(np.uint8)


def _bits(words: _Words, first: int, count: int) -> _Ints:
    """Return ``count`` bits of each word, of which ``first`` is the lowest, as numbers."""
    return (words >> np.uint64(first) & np.uint64((1 << count) - 1)).astype(np.int64)


def _eac_offsets(words: _Words) -> _Ints:
    """Return the modifier of each pixel, (blocks, 16)."""
    index = np.stack([_bits(words, 45 - 3 * i, 3) for i in range(16)], axis=1)
    values = np.take_along_axis(_EAC_MODIFIERS[_bits(words, 48, 4)], index % 4, axis=1)
    return np.where(index < 4, -values, values - 1)


def _alpha(words: _Words) -> _Ints:
    """Return the alpha of EAC blocks, 0..255, (blocks, 16)."""
    base, factor = _bits(words, 56, 8)[:, None], _bits(words, 52, 4)[:, None]
    return np.clip(base + factor * _eac_offsets(words), 0, 255)


def _eleven_bits(words: _Words) -> _Ints:
    """Return the values of EAC blocks of 11 bits, rounded to 0..255, (blocks, 16)."""
    base, factor = _bits(words, 56, 8)[:, None], _bits(words, 52, 4)[:, None]
    values = 8 * base + 4 + np.maximum(8 * factor, 1) * _eac_offsets(words)
    return np.asarray((2 * 255 * np.clip(values, 0, 2047) + 2047) // (2 * 2047), np.int64)


def _colours(words: _Words) -> _Ints:
    """Return the colours of ETC2 blocks, 0..255, (blocks, 16, 3)."""
    bases = np.stack([_bits(words, first, 5) for first in (59, 51, 43)], axis=1)
    steps = np.stack([_bits(words, first, 3) for first in (56, 48, 40)], axis=1)
    others = bases + np.where(steps < 4, steps, steps - 8)
    is_differential = _bits(words, 33, 1) == 1
    overflows = (others < 0) | (others > 31)
    first = np.argmax(overflows, axis=1)  # red says mode T, green mode H, blue planar
    mode = np.where(is_differential & overflows.any(axis=1), 1 + first, 0)
    nibbles = [np.stack([_bits(words, at, 4) for at in places], axis=1)
               for places in ((60, 52, 44), (56, 48, 40))]  # fmt: skip
    halves = [
        np.where(is_differential[:, None], value << 3 | value >> 2, 17 * nibble)
        for value, nibble in zip((bases, others), nibbles, strict=True)
    ]
    found = np.empty((len(words), 16, 3), np.int64)
    modes: list[Callable[..., _Ints]] = [_halves, _mode_t, _mode_h, _planar]
    for number, decode in enumerate(modes):
        some = mode == number
        if some.any():
            found[some] = decode(words[some], *(half[some] for half in halves))
    return np.clip(found, 0, 255)


def _indices(words: _Words) -> _Ints:
    """Return the index of each pixel, 0..3, (blocks, 16)."""
    return np.stack([_bits(words, 16 + i, 1) << 1 | _bits(words, i, 1) for i in range(16)], axis=1)


def _halves(words: _Words, one: _Ints, other: _Ints) -> _Ints:
    """Decode two halves, left and right or upper and lower, each of one colour and brightness."""
    is_second = np.where(_bits(words, 32, 1)[:, None] == 1, _Y >= 2, _X >= 2)
    table = np.where(is_second, _bits(words, 34, 3)[:, None], _bits(words, 37, 3)[:, None])
    index = _indices(words)
    size = _MODIFIERS[table, index & 1]
    colour = np.where(is_second[..., None], other[:, None], one[:, None])
    return np.asarray(colour + np.where(index < 2, size, -size)[..., None], np.int64)


def _mode_t(words: _Words, *_: _Ints) -> _Ints:
    """Decode one colour, and another with two that are a distance from it."""
    red = _bits(words, 59, 2) << 2 | _bits(words, 56, 2)
    one = 17 * np.stack([red, _bits(words, 52, 4), _bits(words, 48, 4)], axis=1)
    other = 17 * np.stack([_bits(words, first, 4) for first in (44, 40, 36)], axis=1)
    distance = _DISTANCES[_bits(words, 34, 2) << 1 | _bits(words, 32, 1)][:, None]
    return _painted(words, [one, other + distance, other, other - distance])


def _mode_h(words: _Words, *_: _Ints) -> _Ints:
    """Decode two pairs of colours, each pair at a distance from its middle."""
    green = _bits(words, 56, 3) << 1 | _bits(words, 52, 1)
    blue = _bits(words, 51, 1) << 3 | _bits(words, 48, 2) << 1 | _bits(words, 47, 1)
    one = np.stack([_bits(words, 59, 4), green, blue], axis=1)
    other = np.stack([_bits(words, first, 4) for first in (43, 39, 35)], axis=1)
    is_larger = (one @ (256, 16, 1) >= other @ (256, 16, 1)).astype(np.int64)
    size = _bits(words, 34, 1) << 2 | _bits(words, 32, 1) << 1 | is_larger
    distance, one, other = _DISTANCES[size][:, None], 17 * one, 17 * other
    return _painted(words, [one + distance, one - distance, other + distance, other - distance])


def _painted(words: _Words, colours: list[_Ints]) -> _Ints:
    """Return the colour of each pixel of (blocks, 3) each, (blocks, 16, 3)."""
    paints = np.stack(colours, axis=1)
    return np.take_along_axis(paints, _indices(words)[..., None], axis=1)


def _planar(words: _Words, *_: _Ints) -> _Ints:
    """Decode a plane through the colours of three corners."""
    green = _bits(words, 56, 1) << 6 | _bits(words, 49, 6)
    blue = _bits(words, 48, 1) << 5 | _bits(words, 43, 2) << 3 | _bits(words, 39, 3)
    red = _bits(words, 34, 5) << 1 | _bits(words, 32, 1)
    origin = _extended(_bits(words, 57, 6), green, blue)
    across = _extended(red, _bits(words, 25, 7), _bits(words, 19, 6))
    down = _extended(_bits(words, 13, 6), _bits(words, 6, 7), _bits(words, 0, 6))
    x, y = _X[None, :, None], _Y[None, :, None]
    o, h, v = (corner[:, None] for corner in (origin, across, down))
    return np.asarray((x * (h - o) + y * (v - o) + 4 * o + 2) >> 2, np.int64)


def _extended(red: _Ints, green: _Ints, blue: _Ints) -> _Ints:
    """Return a colour of 6, 7 and 6 bits in 8, (blocks, 3)."""
    return np.stack([red << 2 | red >> 4, green << 1 | green >> 6, blue << 2 | blue >> 4], axis=1)
