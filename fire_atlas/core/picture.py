"""Decoded frames in the number format of their file, and their conversion to linear light."""

from dataclasses import dataclass
from functools import cache
from typing import Any, Self, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.pixels import (
    REC709,
    Bytes,
    Pixels,
    Plane,
    as_plane,
    brightness,
    encode_bytes,
    encode_unit,
    srgb_to_linear,
    unpremultiply,
)

Picture = NDArray[Any]
"""(H, W, 3) or (H, W, 4), order R, G, B(, A). uint8 and uint16: sRGB and straight alpha over the
full range. float32: linear light, premultiplied."""


@cache
def _light_of_steps(steps: int) -> NDArray[np.float32]:
    """Return the linear light of each of ``steps`` sRGB values from 0 to 1, (steps,) float32."""
    return srgb_to_linear(np.arange(steps) / (steps - 1))


@cache
def _light_table(steps: int) -> NDArray[np.float32]:
    """Return the look-up table from sRGB R, G, B and linear A to light, (1, steps, 4) float32."""
    light, unit = _light_of_steps(steps), np.arange(steps) / (steps - 1)
    return np.dstack([light, light, light, unit.astype(np.float32)])


def white(dtype: np.dtype[Any]) -> int:
    """Return the value that stands for 1.0 in a picture of this type: 255, 65535 or 1."""
    return int(np.iinfo(dtype).max) if dtype.kind == "u" else 1


def with_alpha(picture: Picture) -> Picture:
    """Return the picture with an alpha channel, opaque if it had none."""
    if picture.shape[2] == 4:
        return picture
    full = np.empty((*picture.shape[:2], 4), picture.dtype)
    full[..., :3] = picture
    full[..., 3] = white(picture.dtype)
    return full


def srgb_unit(picture: Picture) -> NDArray[np.float32]:
    """Return R, G, B as sRGB in 0..1, (H, W, 3) float32, as if the picture were opaque."""
    if picture.dtype == np.float32:
        return encode_unit(np.ascontiguousarray(picture[..., :3]))
    return picture[..., :3].astype(np.float32) / np.float32(white(picture.dtype))


def has_transparency(picture: Picture) -> bool:
    """Return whether any pixel is not fully opaque."""
    if picture.shape[2] < 4:
        return False
    return cv2.minMaxLoc(cv2.extractChannel(picture, 3))[0] < white(picture.dtype)


def where_covered(picture: Picture) -> tuple[slice, slice]:
    """Return the rows and columns of the smallest box around all pixels that are not transparent.

    The box is empty if there are none. Fire sprites mostly have a wide transparent border.
    """
    coverage = cv2.extractChannel(picture, 3)
    left, top, width, height = cv2.boundingRect(
        coverage if coverage.dtype == np.uint8 else (coverage > 0).view(np.uint8)
    )
    return slice(top, top + height), slice(left, left + width)


def where_not_empty(picture: Picture) -> tuple[slice, slice]:
    """Return the rows and columns of a box outside of which a picture is empty: transparent, or of
    float pixels, which may glow where they are transparent, 0."""
    height, width, channels = picture.shape
    if picture.dtype.kind == "u":
        return where_covered(picture) if channels == 4 else (slice(0, height), slice(0, width))
    bits = np.ascontiguousarray(picture).view(np.uint32).reshape(height, -1)
    rows = np.flatnonzero(np.bitwise_or.reduce(bits, axis=1))
    columns = np.flatnonzero(np.bitwise_or.reduce(bits, axis=0)) // channels
    if not rows.size:
        return slice(0, 0), slice(0, 0)
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


@dataclass(frozen=True, slots=True)
class CroppedPicture:
    """A picture cropped to what is not empty of it, to save memory.

    Attributes:
        part: That part of it.
        top, left: Place of the part in the picture, px.
        shape: Shape of the picture.
    """

    part: Picture
    top: int
    left: int
    shape: tuple[int, ...]

    @classmethod
    def of(cls, picture: Picture) -> Self:
        """Crop a picture; a part that is all of it is the picture itself."""
        rows, columns = where_not_empty(picture)
        part = picture[rows, columns]
        is_whole = part.shape == picture.shape
        part = picture if is_whole else part.copy()
        return cls(part, rows.start, columns.start, picture.shape)

    def whole(self, *, copy: bool = True) -> Picture:
        """Return the whole picture, black and transparent around its part; without ``copy`` a part
        that is all of it is returned as it is."""
        if not copy and self.part.shape == self.shape:
            return self.part
        whole = np.zeros(self.shape, self.part.dtype)
        height, width = self.part.shape[:2]
        whole[self.top : self.top + height, self.left : self.left + width] = self.part
        return whole


def to_light(picture: Picture) -> Pixels:
    """Return a picture as ``Pixels``, linear light and premultiplied, in a new array."""
    full = with_alpha(picture)
    if full.dtype == np.float32:
        return full.copy() if full is picture else full
    table = _light_table(white(full.dtype) + 1)
    if not has_transparency(full):
        return cast(Pixels, cv2.LUT(np.ascontiguousarray(full), table))
    pixels, covered = np.zeros(full.shape, np.float32), where_covered(full)
    if full[covered].size:
        light = cv2.LUT(np.ascontiguousarray(full[covered]), table)
        alpha = cv2.extractChannel(light, 3)
        weights = cv2.merge((alpha, alpha, alpha, np.ones_like(alpha)))
        cv2.multiply(light, weights, dst=pixels[covered])
    return pixels


def light_of(picture: Picture) -> Picture:
    """Return the light of a picture with as many channels as it has, (H, W, 3 or 4) float32.

    Half as expensive as ``to_light`` for a picture without alpha.
    """
    if picture.shape[2] == 4:
        return to_light(picture)
    if picture.dtype == np.float32:
        return picture
    table = _light_of_steps(white(picture.dtype) + 1)
    return cast(Picture, cv2.LUT(np.ascontiguousarray(picture), table))


def as_light(picture: Picture) -> Pixels:
    """Return ``picture`` (H, W, 4) as ``Pixels``; float32 pictures are returned without a copy."""
    return picture if picture.dtype == np.float32 else to_light(picture)


def as_bytes(picture: Picture) -> Bytes:
    """Return ``picture`` (H, W, 4) as 8-bit straight sRGB and coverage; uint8 without a copy."""
    if picture.dtype == np.uint8:
        return picture
    light = as_light(picture)
    coverage = np.rint(np.clip(light[..., 3:], 0, 1) * 255).astype(np.uint8)
    return np.concatenate([encode_bytes(unpremultiply(light)), coverage], axis=-1)


@cache
def _luminance_tables() -> list[NDArray[np.float32]]:
    """Return the luminance of each 8-bit value of red, of green and of blue, (256,) float32."""
    return [_light_of_steps(256) * weight for weight in REC709]


def brightness_of(picture: Picture, blend_space: str) -> Plane:
    """Return ``pixels.brightness`` (H, W) of a picture (H, W, 4); for 8 bits by fast tables."""
    if picture.dtype != np.uint8:
        return brightness(as_light(picture), blend_space)
    shown, part = np.zeros(picture.shape[:2], np.float32), where_covered(picture)
    if picture[part].size:
        *rgb, coverage = cv2.split(picture[part])
        red, green, blue = map(cv2.LUT, rgb, _luminance_tables())
        light = as_plane(cv2.add(cv2.add(red, green, dst=red), blue, dst=red))
        if blend_space == "linear":
            light = as_plane(cv2.multiply(light, coverage, scale=1 / 255, dtype=cv2.CV_32F))
            np.multiply(encode_unit(light), 255, out=shown[part])
        else:
            cv2.multiply(encode_unit(light), coverage, dst=shown[part], dtype=cv2.CV_32F)
    return shown


def brightest(picture: Picture) -> Picture:
    """Return the largest of R, G, B of each pixel (H, W); numpy is slow along a short axis."""
    red, green, blue = (picture[..., channel] for channel in range(3))
    return np.maximum(np.maximum(red, green), blue)


def darkest(picture: Picture) -> Picture:
    """Return the smallest of R, G, B of each pixel (H, W)."""
    red, green, blue = (picture[..., channel] for channel in range(3))
    return np.minimum(np.minimum(red, green), blue)


def brightest_shown(picture: Picture) -> Plane:
    """Return the largest of R, G, B of each pixel as seen over black, sRGB in 0..1, (H, W)."""
    coverage, peak = picture[..., 3], brightest(picture)
    if picture.dtype == np.float32:
        straight = np.zeros_like(peak)
        np.divide(peak, coverage, out=straight, where=coverage > 0)
        return as_plane(encode_unit(as_plane(straight)) * coverage)
    return as_plane(
        cv2.multiply(peak, coverage, scale=white(picture.dtype) ** -2, dtype=cv2.CV_32F)
    )


def light_of_unit(value: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the linear light, float32, of sRGB values in 0..1, rounded to 16 bits; any shape."""
    flat = np.ascontiguousarray(value).reshape(value.shape[0], -1)
    steps = cv2.addWeighted(flat, 65535, flat, 0.0, 0.0, dtype=cv2.CV_16U)
    return cast(NDArray[np.float32], cv2.LUT(steps, _light_of_steps(65536)).reshape(value.shape))
