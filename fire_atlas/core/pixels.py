"""Light and its encodings: sRGB, hex colours, premultiplied alpha, luminance.

All computing is done on ``Pixels`` (linear light); 8-bit sRGB occurs only in files.
"""

import math
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any, TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", np.uint8, np.float32)

Pixels = NDArray[np.float32]
"""(H, W, 4) float32: linear light R, G, B premultiplied by coverage A, 0..1; light may exceed 1."""

Plane = NDArray[np.float32]
"""(H, W) float32: one value per pixel."""

Bytes = NDArray[np.uint8]
"""(H, W, C) uint8, as in a file."""

REC709 = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Weights of linear R, G, B in luminance (ITU-R BT.709)."""

_XYZ = np.array(
    [[0.4339, 0.3762, 0.1899], [0.2126, 0.7152, 0.0722], [0.0177, 0.1095, 0.8728]], np.float32
)
"""CIE XYZ, of white 1, of linear sRGB."""

_MIN_COVERAGE = np.float32(1e-6)
"""Minimum coverage that light is divided by."""

_LEAST_SEEN = 2
"""Alpha and light, of 255, up to which a pixel cannot be seen."""

_STEPS = 65535

LIGHT_STEPS = _STEPS + 1
"""Number of steps to which light from 0 to 1 is rounded, to look it up in tables."""


def as_plane(array: NDArray[Any]) -> NDArray[np.float32]:
    """Return ``array`` as float32, without a copy if it is float32 already.

    It also tells mypy the type of results of OpenCV.
    """
    return np.asarray(array, np.float32)


def magnitude(x: Plane, y: Plane) -> Plane:
    """Return the lengths of the vectors (x, y), float32; any shape.

    Not by ``cv2.magnitude``: with Intel IPP, the last bits of its results depend on their memory
    address, so that the same recipe would not always give the same files.
    """
    return as_plane(np.sqrt(x * x + y * y))


def srgb_to_linear(value: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return linear light of sRGB values in 0..1, by the exact curve (IEC 61966-2-1); any shape."""
    v = np.asarray(value, np.float64)
    low, high = v / 12.92, ((np.maximum(v, 0.0) + 0.055) / 1.055) ** 2.4
    return np.where(v <= 0.04045, low, high).astype(np.float32)


def linear_to_srgb(value: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return sRGB values in 0..1 of linear light in 0..1, by the exact curve; any shape."""
    return srgb_of(value).astype(np.float32)


def srgb_of(value: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return ``linear_to_srgb`` in double precision, as 16 bits need it."""
    v = np.asarray(value, np.float64)
    low, high = v * 12.92, 1.055 * np.maximum(v, 1e-12) ** (1 / 2.4) - 0.055
    return np.where(v <= 0.0031308, low, high)


@cache
def _linear_of_byte() -> NDArray[np.float32]:
    return srgb_to_linear(np.arange(256) / 255.0)


@cache
def _srgb_of_step() -> NDArray[np.float32]:
    return linear_to_srgb(np.arange(_STEPS + 1) / _STEPS)


@cache
def _linear_of_step() -> NDArray[np.float32]:
    return srgb_to_linear(np.arange(_STEPS + 1) / _STEPS)


@cache
def _byte_of_step() -> NDArray[np.uint8]:
    return np.rint(_srgb_of_step() * 255).astype(np.uint8)


def decode_bytes(image: Bytes) -> NDArray[np.float32]:
    """Return linear light, float32, of 8-bit sRGB values of any channel count."""
    return cast("NDArray[np.float32]", cv2.LUT(image, _linear_of_byte()))


def as_steps(light: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return light as ``LIGHT_STEPS`` steps, rounded and clipped; any shape."""
    if not light.size:  # OpenCV refuses empty pictures
        return np.empty(light.shape, np.uint16)
    flat = np.ascontiguousarray(light).reshape(light.shape[0], -1)
    # addWeighted saturates at 65535, but values beyond 32-bit integers would wrap around. (numpy's
    # minimum and maximum take several times as long as its clip if one side is a number.)
    flat = np.clip(flat, 0, 1)
    steps = cv2.addWeighted(flat, _STEPS, flat, 0.0, 0.0, dtype=cv2.CV_16U)
    return cast("NDArray[np.uint16]", steps.reshape(light.shape))


def _look_up(table: NDArray[Number], light: NDArray[np.float32]) -> NDArray[Number]:
    if not light.size:  # OpenCV refuses empty pictures
        return np.empty(light.shape, table.dtype)
    steps = as_steps(light)
    flat = steps.reshape(steps.shape[0], -1)
    return cast("NDArray[Number]", cv2.LUT(flat, table).reshape(steps.shape))


def encode_bytes(light: NDArray[np.float32]) -> Bytes:
    """Return 8-bit sRGB of linear light; values outside 0..1 are clipped. Any shape."""
    return _look_up(_byte_of_step(), light)


def encode_unit(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return sRGB in 0..1, float32, of linear light; values outside are clipped. Any shape."""
    return _look_up(_srgb_of_step(), light)


def decode_unit(shown: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return linear light of sRGB values in 0..1; values outside are clipped. Any shape."""
    return _look_up(_linear_of_step(), shown)


def expose(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what film shows of linear light, 0..1: x / (1 + x), each channel on its own.

    Its shoulder makes bright embers yellow and the brightest nearly white. Any shape.
    """
    return as_plane(light / (1 + light))


def hex_to_srgb(colors: Sequence[str]) -> NDArray[np.uint8]:
    """Return 8-bit sRGB, (colours, 3), of hex colours such as ``#ff7300``."""
    return np.array([list(bytes.fromhex(color[1:])) for color in colors], np.uint8)


def srgb_to_hex(color: Iterable[int]) -> str:
    """Return an 8-bit sRGB colour as hex, such as ``#ff7300``."""
    return f"#{bytes(color).hex()}"


def hex_to_linear(colors: Sequence[str]) -> NDArray[np.float32]:
    """Return linear light, (colours, 3), of sRGB hex colours such as ``#ff7300``."""
    return srgb_to_linear(hex_to_srgb(colors) / 255)


def premultiply(colour: NDArray[np.float32], alpha: Plane) -> Pixels:
    """Return the pixels of a straight linear colour (H, W, 3) with coverage ``alpha`` (H, W)."""
    pixels = np.empty((*alpha.shape, 4), np.float32)
    np.multiply(colour, alpha[..., None], out=pixels[..., :3])
    pixels[..., 3] = alpha
    return pixels


def unpremultiply(pixels: Pixels) -> NDArray[np.float32]:
    """Return the straight linear colour (H, W, 3) of pixels; black where alpha is 0."""
    alpha = np.ascontiguousarray(pixels[..., 3])
    covered, colour = alpha > 0, np.zeros((*alpha.shape, 3), np.float32)
    for channel in range(3):  # numpy is slow along a short axis
        np.divide(pixels[..., channel], alpha, out=colour[..., channel], where=covered)
    return colour


def light_added(pixels: Pixels, blend_space: str) -> NDArray[np.float32]:
    """Return the light (H, W, 3) that a client adds for pixels: sRGB(c) · coverage, or c · coverage
    where it blends in linear light."""
    if blend_space == "linear":
        return pixels[..., :3]
    coverage = np.maximum(pixels[..., 3:], _MIN_COVERAGE)
    return as_plane(encode_unit(as_plane(pixels[..., :3] / coverage)) * pixels[..., 3:])


def pixels_of_added(
    added: NDArray[np.float32], coverage: NDArray[np.float32], blend_space: str
) -> Pixels:
    """Return pixels (H, W, 4) of which a client adds this light (H, W, 3); the inverse of
    ``light_added``."""
    pixels = np.empty((*coverage.shape, 4), np.float32)
    pixels[..., 3] = coverage
    if blend_space == "linear":
        pixels[..., :3] = added
        return pixels
    covered = np.maximum(coverage, _MIN_COVERAGE)
    for channel in range(3):  # numpy is slow along a short axis
        light = decode_unit(as_plane(added[..., channel] / covered))
        np.multiply(light, coverage, out=pixels[..., channel])
    return pixels


def luminance(pixels: Pixels) -> Plane:
    """Return the relative luminance (H, W), linear, of pixels composited over black."""
    red, green, blue = (cv2.extractChannel(pixels, channel) for channel in range(3))
    light = cv2.addWeighted(red, float(REC709[0]), green, float(REC709[1]), 0.0, dst=red)
    return as_plane(cv2.scaleAdd(blue, float(REC709[2]), light, dst=light))


def hue_difference(one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the distances, ΔE in CIELAB's plane of hues, of linear sRGB colours (n, 3)."""
    roots = [np.cbrt(colours @ _XYZ.T) for colours in (one, other)]
    x, y, z = (roots[0] - roots[1]).T
    return as_plane(np.hypot(500 * (x - y), 200 * (y - z)))


def brightness(pixels: Pixels, blend_space: str) -> Plane:
    """Return the luminance (H, W) that a client shows over black, as sRGB in 0..255.

    The papers use the same scale. With ``blend_space`` ``srgb`` the client shows sRGB(c)·α, with
    ``linear`` sRGB(c·α).
    """
    light = luminance(pixels)
    if blend_space == "linear":
        return encode_unit(light) * np.float32(255)
    alpha = cv2.extractChannel(pixels, 3)
    straight = as_plane(cv2.divide(light, np.maximum(alpha, np.float32(1e-6))))
    return as_plane(cv2.multiply(encode_unit(straight), alpha, scale=255.0))


def is_visible(alpha: NDArray[Any], light: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which pixels of a page can be seen, (H, W).

    Errors of pages are measured over these: the empty part would make them look small.

    Args:
        alpha: (H, W), 0..255.
        light: (H, W), the brightest channel of each pixel over black, 0..255.
    """
    return np.asarray((alpha > _LEAST_SEEN) | (light > _LEAST_SEEN))


def psnr_of(rms: float) -> float:
    """Return the peak signal-to-noise ratio, dB, of a root of the mean squared difference, of 255;
    infinite if nothing differs."""
    return 20 * math.log10(255 / rms) if rms else math.inf
