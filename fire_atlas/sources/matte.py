"""Choose the matte of a clip (where its transparency comes from), and apply it to each frame."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Literal, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import (
    Picture,
    has_transparency,
    light_of_unit,
    srgb_unit,
    to_light,
    where_not_empty,
    white,
    with_alpha,
)
from fire_atlas.core.pixels import Pixels, Plane, as_plane, encode_unit
from fire_atlas.sources.black import TRUE_BLACK, BlackLevel, find_black

Matte = Literal["alpha", "luminance", "none"]

_ROUNDING = 1e-4
"""Maximum error of the darkest values when light is encoded with a 16-bit table."""
_AS_STATED = "the recipe asks for it"
_DARK = 16
"""A pixel looks black if no channel exceeds this, of 255."""
_THUMB_HEIGHT = 128
"""Height, px, at which frames are judged: grain and dither are averaged away, bricks are not."""


@dataclass(frozen=True, slots=True)
class MatteChoice:
    """The matte of a clip.

    Attributes:
        matte: Where its transparency comes from.
        reason: Why, for the user.
        black: What is taken off its frames, for ``luminance``.
    """

    matte: Matte
    reason: str
    black: BlackLevel = TRUE_BLACK


@dataclass(frozen=True, slots=True)
class BorderStatistics:
    """Measurements of the border of opaque frames.

    Attributes:
        dark: Share of the border that is black, 0..1.
        darkest_edge: Share of the darkest of the four edges that is black, 0..1.
        detail: Mean local contrast, of 255, of dim and unmoving parts of the border. Bricks have
            it, glow has not.
        cool: Share of the border that is bright but too blue for fire, 0..1.
    """

    dark: float
    darkest_edge: float
    detail: float
    cool: float


def choose(setting: str, black: str | float, frames: Iterable[Picture], name: str) -> MatteChoice:
    """Return the matte for a clip.

    Args:
        setting: ``source.matte``.
        black: ``source.black``.
        frames: A few frames of the whole clip, which are read only as needed.
        name: The clip, for error messages.

    Raises:
        SourceError: ``matte`` is ``alpha``, but nothing is transparent; or a black is stated, but
            the frames are not fire on black.
    """
    choice = _choose(setting, black, frames, name)
    if choice.matte != "luminance" and black not in ("auto", 0):
        raise SourceError(
            f"is the background of fire on black, but the matte of {name} is {choice.matte} "
            f"({choice.reason}); remove black, or set matte: luminance",
            key=("source", "black"),
        )
    return choice


def _choose(setting: str, black: str | float, frames: Iterable[Picture], name: str) -> MatteChoice:
    if setting == "none":
        return MatteChoice("none", _AS_STATED)
    if setting == "luminance":
        level = _black_of(black, frames)
        return MatteChoice("luminance", _AS_STATED + _describe(level), level)
    opaque = []
    for frame in frames:
        if has_transparency(frame):
            why = "the frames have transparent pixels, so their alpha is the coverage"
            return MatteChoice("alpha", why if setting == "auto" else _AS_STATED)
        opaque.append(frame)
    if setting == "alpha":
        raise SourceError(
            f"is alpha, but the frames of {name} have no transparent pixel; use matte: luminance "
            f"for fire on black, or matte: none for an opaque scene",
            key=("source", "matte"),
        )
    level = _black_of(black, opaque)
    choice = classify(measure_border(opaque, level))
    if choice.matte == "none":
        return choice
    return MatteChoice(choice.matte, choice.reason + _describe(level), level)


def _black_of(setting: str | float, frames: Iterable[Picture]) -> BlackLevel:
    """Return the black that ``source.black`` states, or that is found in sample frames."""
    return find_black(frames) if isinstance(setting, str) else BlackLevel.grey(setting)


def _describe(black: BlackLevel) -> str:
    """Return what is taken off, to be appended to a reason; empty if it is nothing."""
    if max(black.level) == 0:
        return ""
    red, green, blue = (f"{255 * level:.3g}" for level in black.level)
    shown = red if red == green == blue else f"R {red}, G {green}, B {blue}"
    return f"; its black, {shown} of 255, is taken off (source.black: 0 keeps it)"


def classify(border: BorderStatistics) -> MatteChoice:
    """Distinguish fire on black from an opaque scene."""
    share = f"{100 * border.dark:.0f} % of the border is darker than {_DARK}/255"
    if border.dark >= 0.9:
        return MatteChoice("luminance", f"{share}: fire on black, so luminance becomes coverage")
    if border.darkest_edge < 0.6:
        return MatteChoice(
            "none", f"only {share} and no edge is black: an opaque scene, so it stays whole"
        )
    if border.detail >= 0.8 or border.cool > 0.1:
        return MatteChoice(
            "none",
            f"{share}, but the rest shows things that are not fire: an opaque scene, "
            "so it stays whole",
        )
    return MatteChoice(
        "luminance",
        f"{share} and the rest is smooth glow: fire on black, so luminance becomes coverage",
    )


def measure_border(frames: Sequence[Picture], black: BlackLevel = TRUE_BLACK) -> BorderStatistics:
    """Measure the border of opaque sample frames from which ``black`` is taken off."""
    # Sprites may differ in size: all are scaled to the size of the first, to compare pixels.
    size = _thumb_size(frames[0])
    thumbs = np.stack([_thumbnail(frame, size, black) for frame in frames])
    peak = thumbs.max(axis=3)
    height, width = peak.shape[1:]
    band = max(1, round(0.08 * min(height, width)))
    border = np.ones((height, width), bool)
    border[band:-band, band:-band] = False
    dark = peak < _DARK
    edges = (dark[:, :band], dark[:, -band:], dark[:, :, :band], dark[:, :, -band:])
    cool = (thumbs[..., 2] > 0.6 * thumbs[..., 0]) & (peak > 64)
    return BorderStatistics(
        dark=float(dark[:, border].mean()),
        darkest_edge=max(float(edge.mean()) for edge in edges),
        detail=_static_detail(peak, border),
        cool=float(cool[:, border].mean()),
    )


def _thumb_size(frame: Picture) -> tuple[int, int]:
    """Return the width and height, px, at which frames of the size of ``frame`` are judged."""
    height = min(_THUMB_HEIGHT, frame.shape[0])
    width = max(1, round(frame.shape[1] * height / frame.shape[0]))
    return min(width, 2048), height


def _thumbnail(frame: Picture, size: tuple[int, int], black: BlackLevel) -> Picture:
    """Return a small sRGB copy (h, w, 3), float32, 0..255; ``size`` is (width, height)."""
    small = cv2.resize(srgb_unit(frame) * 255, size, interpolation=cv2.INTER_AREA)
    unit = black.taken_off([as_plane(plane) / np.float32(255) for plane in cv2.split(small)])
    return cast(Picture, 255 * cv2.merge(unit))


def _static_detail(peak: Picture, border: NDArray[np.bool_]) -> float:
    """Return the mean local contrast of dim, unmoving pixels of the border.

    Fire moves and its glow is smooth: dim, unmoving edges belong to a scene.

    Args:
        peak: (n, h, w) float32, 0..255: the brightest channel of each sample.
        border: (h, w): True for pixels of the border.
    """
    low, high = peak.min(axis=0), peak.max(axis=0)
    contrast = np.abs(low - cv2.GaussianBlur(low, (0, 0), 2))
    unmoving = (low >= 12) & (high < 128) & (high - low < 32)
    return float((contrast * unmoving)[border].mean())


def apply(
    matte: Matte, picture: Picture, blend_space: str, black: BlackLevel = TRUE_BLACK
) -> Picture:
    """Return a frame (H, W, 4) with the coverage of ``matte``; ``black`` is for ``luminance``.

    If the coverage is the stored alpha, the frame keeps its number format; else it becomes light.
    """
    is_stored = picture.dtype.kind == "u"
    if matte == "alpha":
        return with_alpha(picture) if is_stored else to_light(picture)
    if matte == "none":
        is_whole = is_stored and not has_transparency(picture)
        return with_alpha(picture) if is_whole else over_black(to_light(picture))
    if is_stored and not has_transparency(picture):
        # Computed from the stored values, because noise is recognised by its exact value.
        scale = np.float32(1 / white(picture.dtype))
        coded = [as_plane(plane) * scale for plane in cv2.split(picture)[:3]]
        return _by_luminance(black.taken_off(coded), None, blend_space, black.noise_above)
    return luminance_of_light(to_light(picture), blend_space, black)


def over_black(pixels: Pixels) -> Pixels:
    """Composite pixels over black, in place."""
    pixels[..., 3] = 1
    return pixels


def luminance_of_light(pixels: Pixels, blend_space: str, black: BlackLevel = TRUE_BLACK) -> Pixels:
    """Return pixels whose coverage is their luminance; over black they look the same.

    Light above 1 stays as it is, whatever the level of ``black``.
    """
    found, part = np.zeros((*pixels.shape[:2], 4), np.float32), where_not_empty(pixels)
    if not pixels[part].size:
        return found
    light = [as_plane(plane) for plane in cv2.split(pixels[part])[:3]]
    coded = black.taken_off([encode_unit(plane) for plane in light])
    if max(black.level) > 0:
        light = [
            np.where(plane > 1, plane, light_of_unit(code))
            for plane, code in zip(light, coded, strict=True)
        ]
    found[part] = _by_luminance(coded, light, blend_space, black.noise_above + _ROUNDING)
    return found


def _by_luminance(
    coded: list[Plane], light: list[Plane] | None, blend_space: str, noise: float
) -> Pixels:
    """Make fire on black transparent, so that a client that draws it over black shows it unchanged.

    Coverage is a = max(R, G, B), and colour c / a, since the client draws c / a · a. c is sRGB if
    the client blends sRGB values, and light if it blends light.

    Args:
        coded, light: R, G and B, each (H, W): sRGB in 0..1, and as light if that is known.
        blend_space: ``srgb`` or ``linear``.
        noise: Values of ``coded`` up to this are black.
    """
    peak = _brightest(coded)
    fire = peak > noise
    pixels = np.zeros((*peak.shape, 4), np.float32)
    left, top, width, height = cv2.boundingRect(fire.view(np.uint8))
    if not width:
        return pixels
    part = slice(top, top + height), slice(left, left + width)
    fire, peak, coded = fire[part], peak[part], [plane[part] for plane in coded]
    if blend_space == "linear":
        known = map(light_of_unit, coded) if light is None else (plane[part] for plane in light)
        colour = [plane * fire for plane in known]
        coverage = np.minimum(_brightest(colour), 1)
    else:
        coverage = peak * fire
        scale = np.divide(1, peak, out=np.zeros_like(peak), where=fire)
        colour = [light_of_unit(plane * scale) * coverage for plane in coded]
    cv2.merge((*colour, coverage), dst=pixels[part])
    return pixels


def _brightest(planes: Iterable[Plane]) -> Plane:
    return reduce(np.maximum, planes)
