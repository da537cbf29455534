"""Read the ICC profiles in image files (ICC.1:2022).

A profile with curves and a matrix, as cameras, displays and paint programs write, is applied here,
to 8 and 16 bits alike. One with tables is applied by Pillow's LittleCMS, to 8 bits.
"""

import io
import struct
import zlib
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.files import MIB
from fire_atlas.core.picture import Picture
from fire_atlas.core.pixels import decode_bytes
from fire_atlas.sources.colours import (
    D50,
    IDENTITY,
    Curve,
    FileColours,
    ToneAndMatrix,
    converted_from,
    matrix_from_d50,
)

if TYPE_CHECKING:
    from PIL import ImageCms

MAX_BYTES = 16 * MIB
"""Limit on the size of a profile. Large ones, of printers, have 3 MiB."""

Space = Literal["RGB", "grey"]
"""Channels of a picture."""

_SPACES = {b"RGB ": "RGB", b"GRAY": "grey", b"CMYK": "CMYK"}
_NAME_LENGTH = 40


@lru_cache(maxsize=64)
def colours_of(profile: bytes, space: Space, bits: int) -> FileColours:
    """Return what a profile says about the colours of a picture of ``bits`` 8 or 16 a channel."""
    try:
        return _colours(_Profile.of(profile), profile, space, bits)
    except Exception as error:  # whatever Pillow and numbers that are none may raise
        return _ignored(f"its colour profile is broken ({error})")


@lru_cache(maxsize=64)
def colours_of_compressed(stored: bytes, space: Space, bits: int) -> FileColours:
    """Return ``colours_of`` a profile that is compressed by deflate, as in PNG."""
    try:
        decompressor = zlib.decompressobj()
        profile = decompressor.decompress(stored, MAX_BYTES)
        if not decompressor.eof:
            raise ValueError("it ends early, or is too large")
    except (zlib.error, ValueError) as error:
        return _ignored(f"its colour profile is broken ({error})")
    return colours_of(profile, space, bits)


def _ignored(why: str) -> FileColours:
    return FileColours(notes=(f"{why}: its colours are taken as sRGB",))


@dataclass(frozen=True, slots=True)
class _Profile:
    """Header and tags of a profile.

    Attributes:
        space: Channels of the pictures that it describes; None if they are of another kind.
        is_xyz: Whether it connects them to X, Y, Z.
        tags: The bytes of each tag, by its four letters.
    """

    space: str | None
    is_xyz: bool
    tags: dict[bytes, bytes]

    @classmethod
    def of(cls, profile: bytes) -> "_Profile":
        if profile[36:40] != b"acsp":
            raise ValueError("it has no header of a profile")
        (count,) = struct.unpack_from(">I", profile, 128)
        if 132 + 12 * count > len(profile):
            raise ValueError("it ends inside its list of tags")
        tags = {}
        for i in range(count):
            name, start, length = struct.unpack_from(">4sII", profile, 132 + 12 * i)
            tags[name] = profile[start : start + length]
        return cls(_SPACES.get(profile[16:20]), profile[20:24] == b"XYZ ", tags)

    @property
    def name(self) -> str:
        """Its description, such as "Display P3"."""
        stored = self.tags.get(b"desc", b"")
        if stored[:4] == b"mluc" and len(stored) >= 28:
            length, start = struct.unpack_from(">II", stored, 20)
            text = stored[start : start + length].decode("utf-16-be", "replace")
        else:
            text = stored[12:].split(b"\0")[0].decode("latin-1")
        shown = "".join(character for character in text if character.isprintable()).strip()
        return f"'{shown[:_NAME_LENGTH]}'" if shown else "those of its profile"


def _colours(read: _Profile, profile: bytes, space: Space, bits: int) -> FileColours:
    # Grey is drawn by red, green and blue of one value, which an RGB profile describes as well.
    if read.space != space and (read.space, space) != ("RGB", "grey"):
        kind = read.space or "another kind of"
        return _ignored(f"its colour profile {read.name} is for {kind} pictures, not for {space}")
    if conversion := _tone_and_matrix(read, prefer_tables=bits == 8):
        return converted_from(read.name, conversion)
    if read.space == "grey":
        return converted_from(read.name, _grey_by_tables(profile))
    if bits == 8:
        return converted_from(read.name, _Tables(transform(profile, "RGB")))
    return _ignored(f"its colour profile {read.name} consists of tables, which need 8 bits")


def _tone_and_matrix(read: _Profile, *, prefer_tables: bool) -> ToneAndMatrix | None:
    tags = read.tags
    if not read.is_xyz or (prefer_tables and b"A2B0" in tags):
        return None
    if read.space == "grey" and b"kTRC" in tags:
        curve = _curve(tags[b"kTRC"])
        return ToneAndMatrix((curve, curve, curve), IDENTITY)
    if read.space != "RGB" or not tags.keys() >= {b"rXYZ", b"gXYZ", b"bXYZ", b"rTRC"}:
        return None
    columns = [np.array(_fixed(tags[name], 8, 3)) for name in (b"rXYZ", b"gXYZ", b"bXYZ")]
    matrix = np.column_stack(columns)
    # White, the sum of the primaries, is D50; profiles that are off by more are of another kind.
    if np.abs(matrix.sum(axis=1) - D50).max() > 0.1:
        raise ValueError("its primaries do not add to white")
    red, green, blue = (_curve(tags[name]) for name in (b"rTRC", b"gTRC", b"bTRC"))
    return ToneAndMatrix((red, green, blue), matrix_from_d50(matrix) or IDENTITY)


def _fixed(tag: bytes, at: int, count: int) -> tuple[float, ...]:
    """Return numbers that are stored as s15Fixed16."""
    return tuple(number / 65536 for number in struct.unpack_from(f">{count}i", tag, at))


def _curve(tag: bytes) -> Curve:
    """Return the tone curve in a tag of type ``curv`` or ``para``."""
    if tag[:4] == b"para":
        return _parametric(tag)
    if tag[:4] != b"curv":
        raise ValueError(f"{tag[:4]!r} is no kind of tone curve")
    (count,) = struct.unpack_from(">I", tag, 8)
    if count == 0:
        return lambda value: value
    if count == 1:
        gamma = struct.unpack_from(">H", tag, 12)[0] / 256
        return lambda value: value**gamma
    if 12 + 2 * count > len(tag):
        raise ValueError("it ends inside a tone curve")
    heights = np.frombuffer(tag, ">u2", count, 12) / 65535
    return lambda value: np.interp(value, np.linspace(0, 1, count), heights)


def _parametric(tag: bytes) -> Curve:
    """Return (a x + b)^g + e from d on, and c x + f below (ICC.1:2022, table 68)."""
    (kind,) = struct.unpack_from(">H", tag, 8)
    counts = (1, 3, 4, 5, 7)
    if kind >= len(counts):
        raise ValueError(f"{kind} is no kind of tone curve")
    g, a, b, c, d, e, f = (*_fixed(tag, 12, counts[kind]), *(7 - counts[kind]) * (0.0,))
    if kind == 0:
        a, d = 1.0, 0.0
    if kind in (1, 2):
        c, d, e, f = 0.0, -b / a, c, c

    def curve(value: NDArray[np.float64]) -> NDArray[np.float64]:
        power = np.maximum(a * value + b, 0) ** g + e
        return np.where(value >= d, power, c * value + f)

    return curve


@dataclass(frozen=True, slots=True)
class _Tables:
    """A profile with tables, for R, G and B of 8 bits, applied by LittleCMS."""

    transform: "ImageCms.ImageCmsTransform"

    def apply(self, picture: Picture) -> Picture:
        """Return a picture (H, W, 3 or 4), uint8, in sRGB; its alpha is unchanged."""
        from PIL import Image

        converted = picture.copy()
        colours = Image.fromarray(np.ascontiguousarray(picture[..., :3]))
        converted[..., :3] = np.asarray(self.transform.apply(colours))
        return converted


def _grey_by_tables(profile: bytes) -> ToneAndMatrix:
    """Return the curve of a profile of greys that LittleCMS finds."""
    from PIL import Image

    ramp = Image.fromarray(np.arange(256, dtype=np.uint8)[None])
    shown = np.asarray(transform(profile, "L").apply(ramp))[0, :, 0]
    light = decode_bytes(shown).astype(np.float64).ravel()

    def curve(value: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.interp(value, np.linspace(0, 1, 256), light)

    return ToneAndMatrix((curve, curve, curve), IDENTITY)


@lru_cache(maxsize=16)
def cmyk_transform(profile: bytes) -> "ImageCms.ImageCmsTransform | None":
    """Return the transform of Pillow's CMYK images to sRGB; None if the profile is broken, or for
    other pictures."""
    try:
        return transform(profile, "CMYK")
    except Exception:  # Pillow raises several types
        return None


def transform(profile: bytes, mode: str) -> "ImageCms.ImageCmsTransform":
    """Return LittleCMS' transform from a profile to sRGB, for Pillow images of ``mode``, by the
    intent that the profile states.

    Raises:
        Exception: The profile is broken; Pillow raises several types.
    """
    from PIL import ImageCms

    source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
    target = ImageCms.createProfile("sRGB")
    intent = ImageCms.Intent(ImageCms.getDefaultIntent(source))
    return ImageCms.buildTransform(source, target, mode, "RGB", intent)
