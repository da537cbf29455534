"""Images of vectors, of motion or haze: their scale, their pixels, what the JSON says of them."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fire_atlas.atlas.drawing import Edges
from fire_atlas.atlas.sheet import AtlasSheet, Rect, Region, VectorScale
from fire_atlas.core.checks import number
from fire_atlas.core.decimals import plain
from fire_atlas.core.pixels import Bytes, as_plane
from fire_atlas.maps.vectors.encoding import MotionEncoding, motion_encoding
from fire_atlas.maps.vectors.flow import Vectors
from fire_atlas.vision.warp import sample_at

if TYPE_CHECKING:
    from fire_atlas.maps.vectors.estimate import FrameVectors

MIN_LONGEST = 0.5
"""The scale allows for motion of at least this many px: a finer scale is not worth it."""

_MAX_STRENGTH = 1e6
"""Maximum motion per decoded 1 accepted when reading, in any unit."""

_SCALE_DIGITS = 4
"""Significant digits of a scale: few, because people copy it by hand."""


def vector_scale(
    sheet: AtlasSheet, lengths: Sequence[tuple[float, float]], encoding: MotionEncoding
) -> VectorScale:
    """Return one scale for vectors whose ``lengths`` along x and y, px at full size, are the
    longest of each animation on a sheet."""
    x, y = (max(length[axis] for length in lengths) for axis in (0, 1))
    longest = max(x, MIN_LONGEST) * sheet.scale, max(y, MIN_LONGEST) * sheet.scale
    cell = (sheet.grid.cell_width, sheet.grid.cell_height) if sheet.grid else None
    unit = encoding.unit_pixels(cell)
    scale = rounded_up(max(longest[0] / unit[0], longest[1] / unit[1]))
    pixels = scale * unit[0], scale * unit[1]
    return VectorScale(
        engine=encoding.engine,
        scale=scale,
        pixels=pixels,
        cell_uv=(pixels[0] / cell[0], pixels[1] / cell[1]) if cell else None,
        longest=longest,
        gutter=_gutter(sheet),
    )


def _gutter(sheet: AtlasSheet) -> tuple[int, int] | None:
    """Return the minimum gap, px, between a frame and its cell's edges in x and y, if in cells."""
    grid = sheet.grid
    if grid is None:
        return None
    around = [
        (left, grid.cell_width - left - region.width, top, grid.cell_height - top - region.height)
        for region in sheet.regions
        for left, top in [(region.x % grid.cell_width, region.y % grid.cell_height)]
    ]
    left, right, top, bottom = (min(sides) for sides in zip(*around, strict=True))
    return min(left, right), min(top, bottom)


def rounded_up(value: float) -> float:
    """Return ``value`` rounded up to ``_SCALE_DIGITS`` significant digits."""
    step = 10.0 ** (math.floor(math.log10(value)) + 1 - _SCALE_DIGITS)
    return round(math.ceil(value / step - 1e-9) * step, 12)


def draw_vector_page(
    sheet: AtlasSheet, page: int, kind: str, frames: "Sequence[FrameVectors]", edges: Edges
) -> Bytes:
    """Draw one page, (H, W, 4) uint8: R and G are the vectors of the sheet's regions, in order.

    B is 0; A is 255, because importers may change colours that are transparent.

    Args:
        sheet: The sheet with its maps.
        page: Index of the page.
        kind: ``motion`` or ``haze``.
        frames: Vectors of each region's frame.
        edges: Space around a frame on its page.
    """
    scale = sheet.map(kind).vectors
    assert scale is not None, "maps of vectors have a scale"
    encoding, unit = motion_encoding(scale.engine), np.array(scale.pixels, np.float32)
    size = sheet.pages[page].height, sheet.pages[page].width
    image = np.empty((*size, 4), np.uint8)
    image[:] = (encoding.neutral, encoding.neutral, 0, 255)
    for region, frame in zip(sheet.regions, frames, strict=True):
        if region.page == page:
            place = _place(sheet, region, edges.margin)
            vectors = _vectors(frame, region, place, sheet.scale)
            if sheet.grid is not None and kind == "motion":
                vectors = _shortened(vectors, place, _owned(region, edges.extrude))
            part = slice(place.y, place.y + place.height), slice(place.x, place.x + place.width)
            image[part][..., :2] = encoding.encode(as_plane(vectors / unit))
    return image


def _place(sheet: AtlasSheet, region: Region, margin: int) -> Rect:
    """Return the rectangle of the page that a frame's vectors fill: its cell, or its margin."""
    grid = sheet.grid
    if grid is not None:
        x, y = (
            region.x // grid.cell_width * grid.cell_width,
            region.y // grid.cell_height * grid.cell_height,
        )
        return Rect(x, y, grid.cell_width, grid.cell_height)
    page = sheet.pages[region.page]
    x, y = max(region.x - margin, 0), max(region.y - margin, 0)
    right = min(region.x + region.width + margin, page.width)
    bottom = min(region.y + region.height + margin, page.height)
    return Rect(x, y, right - x, bottom - y)


def _owned(region: Region, extrude: int) -> Rect:
    """Return the rectangle of the frame and its extruded edge on the page."""
    return Rect(
        region.x - extrude,
        region.y - extrude,
        region.width + 2 * extrude,
        region.height + 2 * extrude,
    )


def _vectors(frame: "FrameVectors", region: Region, place: Rect, scale: float) -> Vectors:
    """Return the vectors at the pixels of ``place`` on the page, in px of the page per frame.

    Outside the frame they are those at its edge; beside a tile, those of the next one.
    """
    small = frame.cells.astype(np.float32)
    height, width = small.shape[:2]
    x = np.arange(place.width, dtype=np.float32) + (place.x + 0.5 - region.x + region.trim_x)
    y = np.arange(place.height, dtype=np.float32) + (place.y + 0.5 - region.y + region.trim_y)
    column, row = np.meshgrid(
        x * np.float32(width / (scale * frame.width)) - np.float32(0.5),
        y * np.float32(height / (scale * frame.height)) - np.float32(0.5),
    )
    return as_plane(sample_at(small, column, row, tiles=frame.tiles) * np.float32(scale))


def _shortened(vectors: Vectors, place: Rect, frame: Rect) -> Vectors:
    """Shorten vectors at ``place`` on the page that would move a sample out of ``frame``.

    An engine samples along the vector while a frame fades in and against it while it fades out:
    neither may reach a neighbour's pixels.
    """
    x = np.arange(place.width, dtype=np.float32) + (place.x - frame.x)
    y = np.arange(place.height, dtype=np.float32) + (place.y - frame.y)
    for axis, along, length in ((0, x[None, :], frame.width), (1, y[:, None], frame.height)):
        room = np.maximum(np.minimum(along, length - 1 - along), 0)
        vectors[..., axis] = np.clip(vectors[..., axis], -room, room)
    return vectors


def scale_entry(stated: VectorScale) -> dict[str, Any]:
    """Return how a client decodes vectors, for the JSON."""
    encoding = motion_encoding(stated.engine)
    return {
        "red": "right",
        "green": encoding.green,
        "srgb": False,
        "neutral": encoding.neutral,
        "decode": encoding.decode,
        "scale": plain(stated.scale, 9),
        "unit": encoding.unit,
    }


def pair(values: tuple[float, float], digits: int) -> list[float]:
    """Return two numbers, rounded, for the JSON."""
    return [plain(values[0], digits), plain(values[1], digits)]


def pair_of(values: Sequence[Any]) -> tuple[float, float]:
    """Read two numbers from the JSON."""
    return strength(values[0]), strength(values[1])


def strength(value: Any) -> float:
    """Read what a decoded value of 1 means, in any unit, from the JSON."""
    return number(value, -_MAX_STRENGTH, _MAX_STRENGTH)
