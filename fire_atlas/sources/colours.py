"""Convert pictures from the colours of their file to sRGB.

Most files say sRGB, or nothing, and are read as they are. A file that says something else has a
tone curve for each channel and a matrix between its primaries and those of sRGB (``ToneAndMatrix``,
for any depth), or, as printers and scanners do, a table, which Pillow applies (``icc.py``).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import Picture, white
from fire_atlas.core.pixels import encode_bytes, srgb_of

Matrix = tuple[tuple[float, float, float], ...]
"""Three rows: of red, green and blue light in the linear light of sRGB."""

Curve = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Linear light of the values 0..1 that a file stores."""

Chromaticities = tuple[float, float, float, float, float, float, float, float]
"""CIE x and y of red, green, blue and white."""

_D65 = (0.3127, 0.3290)
SRGB_PRIMARIES: Chromaticities = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, *_D65)
PRIMARIES: Mapping[int, Chromaticities] = {
    1: SRGB_PRIMARIES,
    5: (0.64, 0.33, 0.29, 0.60, 0.15, 0.06, *_D65),
    6: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *_D65),
    7: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *_D65),
    9: (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *_D65),
    11: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351),
    12: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *_D65),
}  # fmt: skip
"""Of the numbers of ITU-T H.273, as in PNGs and videos: 9 is BT.2020, 12 is Display P3."""

D50 = (0.9642, 1.0, 0.8249)
"""White of ICC profiles, X, Y, Z."""

_BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
"""From X, Y, Z to responses of cones, in which whites are adapted to each other."""

_NEAR = 1e-3
"""Largest difference from the identity of a matrix that says sRGB. Primaries that were rounded to
three digits stay below it."""


class Conversion(Protocol):
    """What turns the colours of a file into sRGB."""

    def apply(self, picture: Picture) -> Picture:
        """Return a picture (H, W, 3 or 4) in sRGB; its alpha is unchanged."""


@dataclass(frozen=True, slots=True)
class FileColours:
    """What the header of a file says about its colours.

    Attributes:
        conversion: What turns them into sRGB; None if they are sRGB, or are taken as it.
        notes: For the user: that they are converted, or what of the file's words is not honoured.
    """

    conversion: Conversion | None = None
    notes: tuple[str, ...] = ()


AS_SRGB = FileColours()
"""The colours of most files."""


@dataclass(frozen=True, slots=True)
class ToneAndMatrix:
    """A tone curve for each channel, and a matrix; for 8 and 16 bits a channel.

    Attributes:
        curves: Of red, green and blue.
        matrix: From the file's linear light to that of sRGB. What is outside of sRGB is clipped.
    """

    curves: tuple[Curve, Curve, Curve]
    matrix: Matrix

    def apply(self, picture: Picture) -> Picture:
        """Return a picture (H, W, 3 or 4), uint8 or uint16, in sRGB; its alpha is unchanged."""
        colours = np.ascontiguousarray(picture[..., :3])
        light = cv2.LUT(colours, _light_of_levels(self.curves, white(picture.dtype)))
        converted = picture.copy()
        converted[..., :3] = _encoded(cv2.transform(light, np.array(self.matrix)), picture.dtype)
        return converted


def _encoded(light: Picture, dtype: np.dtype[Any]) -> Picture:
    if dtype == np.uint8:
        return encode_bytes(light)  # by a table: a tenth of the time
    return np.rint(srgb_of(np.clip(light, 0, 1)) * white(dtype)).astype(dtype)


@lru_cache(maxsize=16)
def _light_of_levels(curves: tuple[Curve, Curve, Curve], top: int) -> NDArray[np.float32]:
    """Return the look-up table from R, G, B of 0..``top`` to light, (1, top + 1, 3)."""
    with np.errstate(all="ignore"):  # a damaged curve may leave the numbers
        light = np.dstack([curve(np.arange(top + 1) / top) for curve in curves])
    return np.clip(np.nan_to_num(light, posinf=1.0), 0, 1).astype(np.float32)


def with_matrix(light: Picture, matrix: Matrix) -> Picture:
    """Return linear light (H, W, 3 or 4), float32, after a matrix; alpha is unchanged."""
    converted = light.copy()
    for channel, (of_red, of_green, of_blue) in enumerate(matrix):
        converted[..., channel] = (
            of_red * light[..., 0] + of_green * light[..., 1] + of_blue * light[..., 2]
        )
    return converted


def changes_colours(conversion: Conversion) -> bool:
    """Return whether a conversion changes any of a few hundred 8-bit colours by more than 1.

    Profiles of sRGB differ in their last digits; files that have them are read as they are.
    """
    ramp, few = np.arange(256), np.arange(0, 256, 51)
    greys = np.repeat(ramp[:, None], 3, axis=1)
    primaries = [ramp[:, None] * np.eye(3, dtype=int)[channel] for channel in range(3)]
    mixed = np.stack(np.meshgrid(few, few, few), axis=-1).reshape(-1, 3)
    colours = np.concatenate([greys, *primaries, mixed]).astype(np.uint8)[None]
    converted = conversion.apply(colours).astype(int)
    return bool(np.abs(converted - colours).max() > 1)


def matrix_to_srgb(chromaticities: Chromaticities) -> Matrix | None:
    """Return the matrix from linear light of these primaries to that of sRGB; None if there is no
    difference.

    White becomes white: the eye is adapted to it (Bradford).

    Raises:
        ValueError: They are no primaries: on one line, or without luminance.
    """
    ours = xyz_of(SRGB_PRIMARIES)
    adapted = _adaptation(_xyz_of_white(chromaticities), _xyz_of_white(SRGB_PRIMARIES))
    return _unless_identity(np.linalg.inv(ours) @ adapted @ xyz_of(chromaticities))


def matrix_from_d50(columns: NDArray[np.float64]) -> Matrix | None:
    """Return the matrix to the linear light of sRGB from primaries whose X, Y, Z, adapted to D50 as
    in ICC profiles, are the columns; None if there is no difference.

    Raises:
        ValueError: They are no numbers.
    """
    ours = _adaptation(_xyz_of_white(SRGB_PRIMARIES), np.array(D50)) @ xyz_of(SRGB_PRIMARIES)
    return _unless_identity(np.linalg.inv(ours) @ columns)


def xyz_of(chromaticities: Chromaticities) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from linear R, G, B to X, Y, Z with Y = 1 for white.

    Raises:
        ValueError: They are no primaries: on one line, or without luminance.
    """
    pairs = np.reshape(chromaticities[:6], (3, 2))
    primaries = np.vstack([pairs.T, 1 - pairs.sum(axis=1)])
    if not np.abs(pairs).max() < 10 or abs(np.linalg.det(primaries)) < 1e-6:
        raise ValueError("they are no primaries")
    return np.asarray(primaries * np.linalg.solve(primaries, _xyz_of_white(chromaticities)))


def _xyz_of_white(chromaticities: Chromaticities) -> NDArray[np.float64]:
    """Return X, Y, Z of white, (3,), with Y = 1.

    Raises:
        ValueError: It is no white.
    """
    x, y = chromaticities[6:]
    if not (0.05 < x < 0.95 and 0.05 < y < 0.95):
        raise ValueError(f"its white, ({x:g}, {y:g}), is none")
    return np.array([x / y, 1.0, (1 - x - y) / y])


def _adaptation(white: NDArray[np.float64], to: NDArray[np.float64]) -> NDArray[np.float64]:
    gains = (_BRADFORD @ to) / (_BRADFORD @ white)
    return np.asarray(np.linalg.inv(_BRADFORD) @ (gains[:, None] * _BRADFORD))


def _unless_identity(matrix: NDArray[np.float64]) -> Matrix | None:
    """Return a matrix; None if it changes nothing.

    Rounded: its last digits depend on the linear algebra of the machine.

    Raises:
        ValueError: It holds what is no number.
    """
    if not np.isfinite(matrix).all():
        raise ValueError("its primaries are no numbers")
    if np.abs(matrix - np.eye(3)).max() < _NEAR:
        return None
    rows: list[Any] = np.round(matrix, 9).tolist()
    return tuple((row[0], row[1], row[2]) for row in rows)


IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def converted_from(name: str, conversion: Conversion) -> FileColours:
    """Return the colours of a file that says ``name``, such as "Display P3"; as they are if the
    conversion changes nothing that is visible."""
    if not changes_colours(conversion):
        return AS_SRGB
    note = f"its colours are converted from {name} to sRGB; those beyond sRGB are clipped"
    return FileColours(conversion, (note,))
