"""The colours of a PNG, by the chunks that say so (PNG, third edition, sections 4.3 and 11.3.2).

Of several, the first of cICP, iCCP, sRGB, and gAMA with cHRM counts.
"""

import struct
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import srgb_to_linear
from fire_atlas.sources import icc
from fire_atlas.sources.colours import (
    AS_SRGB,
    IDENTITY,
    PRIMARIES,
    SRGB_PRIMARIES,
    Chromaticities,
    Curve,
    FileColours,
    ToneAndMatrix,
    converted_from,
    matrix_to_srgb,
)
from fire_atlas.sources.png import Head

_GAMMA_OF_SRGB, _ROUNDED = 45455, 500
"""What files in sRGB say in gAMA, whose true curve is no power; many programs round it to 0.45."""

_SRGB_CURVES = (1, 6, 13, 14, 15)
"""Transfer characteristics (ITU-T H.273) that are shown as sRGB, as those of videos are."""

_POWERS = {4: 2.2, 5: 2.8, 8: 1.0}
_HDR = {16: "PQ", 18: "HLG"}


def colours_of_png(head: Head) -> FileColours:
    """Return what a PNG says about its colours."""
    chunks = head.chunks
    if b"cICP" in chunks:
        return _by_numbers(chunks[b"cICP"])
    if b"iCCP" in chunks:
        _, _, stored = chunks[b"iCCP"].partition(b"\0")
        space: icc.Space = "RGB" if head.has_colour else "grey"
        return icc.colours_of_compressed(stored[1:], space, 16 if head.bits == 16 else 8)
    if b"sRGB" in chunks:
        return AS_SRGB
    return _by_gamma(chunks.get(b"gAMA", b""), chunks.get(b"cHRM", b""))


@lru_cache(maxsize=16)
def _by_numbers(stored: bytes) -> FileColours:
    if len(stored) != 4:
        return _ignored("its cICP chunk is broken")
    primaries, transfer, matrix, full_range = stored
    if transfer in _HDR:
        return _ignored(f"it is HDR ({_HDR[transfer]}), for which sRGB has no one right picture")
    known_curve = transfer in _SRGB_CURVES or transfer in _POWERS
    if not known_curve or primaries not in PRIMARIES or matrix or full_range != 1:
        return _ignored(f"its cICP chunk states colours that are not known ({[*stored]})")
    curve = _srgb_curve if transfer in _SRGB_CURVES else _power(_POWERS[transfer])
    return _converted("its cICP chunk", curve, PRIMARIES[primaries])


@lru_cache(maxsize=16)
def _by_gamma(gamma: bytes, chromaticities: bytes) -> FileColours:
    if not gamma and not chromaticities:
        return AS_SRGB
    try:
        encoded = struct.unpack(">I", gamma)[0] if gamma else _GAMMA_OF_SRGB
        places = struct.unpack(">8I", chromaticities) if chromaticities else ()
    except struct.error:
        return _ignored("its gAMA or cHRM chunk is broken")
    if not 1_000 <= encoded <= 10_000_000:
        return _ignored(f"it states a gamma of {encoded / 1e5:g}")
    white, colours = places[:2], places[2:]
    primaries = [place / 1e5 for place in (*colours, *white)] or SRGB_PRIMARIES
    is_srgb = abs(encoded - _GAMMA_OF_SRGB) <= _ROUNDED
    curve = _srgb_curve if is_srgb else _power(1e5 / encoded)
    return _converted("its gAMA and cHRM chunks", curve, tuple(primaries))


def _converted(where: str, curve: Curve, primaries: Chromaticities) -> FileColours:
    try:
        matrix = matrix_to_srgb(primaries) or IDENTITY
    except ValueError as error:
        return _ignored(f"{where} make no sense ({error})")
    return converted_from(f"those of {where}", ToneAndMatrix((curve, curve, curve), matrix))


def _ignored(why: str) -> FileColours:
    return FileColours(notes=(f"{why}: its colours are taken as sRGB",))


def _srgb_curve(value: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the light of sRGB values."""
    return srgb_to_linear(value).astype(np.float64)


def _power(gamma: float) -> Curve:
    return lambda value: value**gamma
