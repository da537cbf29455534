"""Draw the marks of ``field_marks.py`` over darkened frames, with a legend, as PNG files."""

import io

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fire_atlas.atlas.encode import encode_frame
from fire_atlas.core.pixels import Bytes, Pixels
from fire_atlas.preview.blend import blend
from fire_atlas.preview.field_marks import (
    LAYERS,
    LONGEST,
    RAMP,
    SHORTEST,
    FieldLayer,
    FieldMarks,
    Marks,
    size_text,
    sizes_of,
)

_BACKGROUND, _INK, _DIM = (16, 16, 20), (225, 225, 230), (150, 150, 162)

_SIDE = 640
"""Smaller frames are enlarged, by a whole number, to about this side, px."""

_LEAST_WIDTH, _LEGEND, _FONT = 480, 46, 14

_BRIGHT, _BRIGHT_BLUR = 0.42, 0.75
"""Brightness of a frame under marks, relative to its own: under blur it is to be seen too."""

_SHIFT = 4
"""Binary digits behind the point in the coordinates that OpenCV draws."""


def frame_picture(frame: Pixels, text: str) -> bytes:
    """Return a PNG of a frame without marks, of the same size as those with marks."""
    return _with_legend(_enlarged(frame, 1.0)[0], "The frame as it is analysed", text)


def field_picture(layer: FieldLayer, frame: Pixels, marks: FieldMarks, i: int, text: str) -> bytes:
    """Return a PNG of one layer over a frame.

    Args:
        layer: Which.
        frame: The frame, as it lies under the layer.
        marks: Of the whole animation.
        i: Index of the frame.
        text: What the picture is of.
    """
    picture, zoom = _enlarged(frame, _BRIGHT_BLUR if layer == "blur" else _BRIGHT)
    longest, drawn = marks.longest[layer], marks.frames[i][layer]
    words = LAYERS[layer]
    if not longest:
        return _with_legend(picture, words.title, text, "none in this clip")
    if layer == "candidates":
        reach = _reach(marks, zoom)
        _draw_dots(picture, drawn, longest, reach, zoom)
    else:
        reach = marks.grid.spacing * zoom * LONGEST
        _draw_arrows(picture, drawn, longest, reach, zoom)
    size = size_text(longest, layer)
    return _with_legend(picture, words.title, text, size, layer, reach)


def _enlarged(frame: Pixels, brightness: float) -> tuple[Bytes, int]:
    """Return a frame over black, (H, W, 3) sRGB, and how many times as large it is."""
    shown = blend(encode_frame(frame, "straight", "srgb"), (0, 0, 0), "straight", "srgb")
    height, width = shown.shape[:2]
    zoom = max(1, round(_SIDE / max(height, width)))
    if brightness < 1:  # and half as colourful, so that marks stand out
        shown = (shown + shown.mean(axis=2, keepdims=True)) * (brightness / 2)
    dark = np.rint(shown).astype(np.uint8)
    size = width * zoom, height * zoom
    return np.asarray(cv2.resize(dark, size, interpolation=cv2.INTER_LINEAR), np.uint8), zoom


def _reach(marks: FieldMarks, zoom: int) -> float:
    """Radius of the heaviest dot, px of the picture."""
    return max(0.8 * marks.grid.block * zoom, 2.0)


def _draw_arrows(picture: Bytes, arrows: Marks, longest: float, reach: float, zoom: int) -> None:
    size = sizes_of(arrows) / longest
    for n in np.argsort(size, kind="stable"):
        if size[n] >= SHORTEST:
            x, y, dx, dy = arrows[n]
            step = reach * min(size[n], 1.0) / (size[n] * longest)
            start = x * zoom, y * zoom
            _arrow(picture, start, (start[0] + dx * step, start[1] + dy * step), size[n])


def _arrow(
    picture: Bytes, start: tuple[float, float], end: tuple[float, float], size: float
) -> None:
    """Draw an arrow; ``size`` 0..1 decides its colour."""
    length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
    tip = min(7.0 / max(length, 1e-6), 0.45)
    cv2.arrowedLine(picture, _fixed(start), _fixed(end), _colour(size), 1, cv2.LINE_AA, _SHIFT, tip)


def _draw_dots(picture: Bytes, dots: Marks, longest: float, reach: float, zoom: int) -> None:
    for x, y, weight in dots[np.argsort(dots[:, 2], kind="stable")]:
        _dot(picture, (x * zoom, y * zoom), min(weight / longest, 1.0), reach)


def _dot(picture: Bytes, centre: tuple[float, float], size: float, reach: float) -> None:
    """Draw a dot whose area is proportional to ``size``, 0..1."""
    radius = max(round(reach * size**0.5 * 2**_SHIFT), 2 ** (_SHIFT - 1))
    cv2.circle(picture, _fixed(centre), radius, _colour(size), cv2.FILLED, cv2.LINE_AA, _SHIFT)


def _fixed(point: tuple[float, float]) -> tuple[int, int]:
    """Return a point, px from the corner of the picture, as OpenCV counts from the first pixel."""
    x, y = (round((float(each) - 0.5) * 2**_SHIFT) for each in point)
    return x, y


def _colour(size: float) -> tuple[float, float, float]:
    stops = np.linspace(0, 1, len(RAMP))
    r, g, b = (float(np.interp(size, stops, each)) for each in zip(*RAMP, strict=True))
    return r, g, b


def _with_legend(
    picture: Bytes,
    title: str,
    text: str,
    size: str = "",
    layer: FieldLayer | None = None,
    reach: float = 0.0,
) -> bytes:
    """Return a PNG of a picture above its title, what it is of, and the largest mark: ``size``."""
    height, width = picture.shape[:2]
    whole = Image.new("RGB", (max(width, _LEAST_WIDTH), height + _LEGEND), _BACKGROUND)
    draw, font = ImageDraw.Draw(whole), ImageFont.load_default(_FONT)
    whole.paste(Image.fromarray(picture), ((whole.width - width) // 2, 0))
    draw.text((8, height + 4), title, fill=_INK, font=font)
    left, middle = 8.0, height + 33.0
    canvas = np.asarray(whole).copy()
    if layer == "candidates":
        for part in (0.1, 0.4, 1.0):
            left += reach + 2
            _dot(canvas, (left, middle), part, reach)
            left += reach + 2
        size = f"weight up to {size}"
    elif layer is not None:
        for part in (0.25, 0.5, 1.0):
            _arrow(canvas, (left, middle), (left + reach * part, middle), part)
            left += reach * part + 8
        size = f"= {size}"
    whole = Image.fromarray(canvas)
    draw = ImageDraw.Draw(whole)
    draw.text((left + 4 * (layer is not None), height + 25), size, fill=_DIM, font=font)
    draw.text((whole.width - 8, height + 25), text, fill=_DIM, font=font, anchor="ra")
    file = io.BytesIO()
    whole.save(file, "PNG")
    return file.getvalue()
