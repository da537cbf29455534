"""Motion vectors and layers beside the pages of a sheet: their names, scale and pages."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from fire_atlas.atlas.drawing import Edges
from fire_atlas.atlas.sheet import AtlasSheet, MotionScale, Rect, Region, SheetMap
from fire_atlas.channels.encoding import MotionEncoding
from fire_atlas.channels.flow import Vectors
from fire_atlas.channels.motion import FrameMotion, Motion
from fire_atlas.core.pixels import Bytes, as_plane
from fire_atlas.recipe.output import Layer
from fire_atlas.vision.warp import sample_at

_SMALLEST_SCALE = 0.5
"""px; shorter motion is not worth a finer scale."""

_SCALE_DIGITS = 4
"""Significant digits of a scale: people copy it."""


def vector_margin(motions: Iterable[Motion]) -> int:
    """Return how many px around a frame have to be kept: vectors lead samples that far away."""
    return math.ceil(max((max(motion.longest) for motion in motions), default=0))


def with_maps(
    sheet: AtlasSheet,
    layers: Sequence[Layer],
    motions: Sequence[Motion],
    encoding: MotionEncoding | None,
) -> AtlasSheet:
    """Return ``sheet`` with the maps beside its pages; one scale serves all ``motions`` on them."""
    maps = []
    if encoding is not None:
        scale = _motion_scale(sheet, motions, encoding)
        maps.append(SheetMap("motion", _files(sheet, "motion"), scale))
    maps += [SheetMap(layer, _files(sheet, layer)) for layer in layers]
    return replace(sheet, maps=tuple(maps))


def _files(sheet: AtlasSheet, kind: str) -> tuple[str, ...]:
    ending = f".{kind}.{sheet.image_format}"
    return tuple(sheet.file(page, ending) for page in range(len(sheet.pages)))


def _motion_scale(
    sheet: AtlasSheet, motions: Sequence[Motion], encoding: MotionEncoding
) -> MotionScale:
    x, y = (max(motion.longest[axis] for motion in motions) for axis in (0, 1))
    longest = max(x, _SMALLEST_SCALE) * sheet.scale, max(y, _SMALLEST_SCALE) * sheet.scale
    cell = (sheet.grid.cell_width, sheet.grid.cell_height) if sheet.grid else None
    unit = encoding.unit_pixels(cell)
    scale = _rounded_up(max(longest[0] / unit[0], longest[1] / unit[1]))
    pixels = scale * unit[0], scale * unit[1]
    return MotionScale(
        engine=encoding.engine,
        scale=scale,
        pixels=pixels,
        cell_uv=(pixels[0] / cell[0], pixels[1] / cell[1]) if cell else None,
        longest=longest,
        gutter=_gutter(sheet),
    )


def _gutter(sheet: AtlasSheet) -> tuple[int, int] | None:
    """Return the narrowest px around any frame in its cell, along x and y; None without cells."""
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


def _rounded_up(value: float) -> float:
    """Return ``value`` rounded up to a few digits."""
    step = 10.0 ** (math.floor(math.log10(value)) + 1 - _SCALE_DIGITS)
    return round(math.ceil(value / step - 1e-9) * step, 12)


def draw_motion_page(
    sheet: AtlasSheet,
    page: int,
    frames: Sequence[FrameMotion],
    encoding: MotionEncoding,
    edges: Edges,
) -> Bytes:
    """Draw one page, (H, W, 4) uint8: R and G are the vectors of the sheet's regions, in order.

    Args:
        sheet: With its ``motion``.
        page: Its number.
        frames: How the frame of each region moves.
        encoding: How the engine encodes R and G. B is 0 and A 255: importers change colours that
            are transparent.
        edges: What goes around a frame on its page.
    """
    assert sheet.motion is not None, "vectors are drawn where the sheet has their scale"
    unit = np.array(sheet.motion.pixels, np.float32)
    size = sheet.pages[page].height, sheet.pages[page].width
    image = np.empty((*size, 4), np.uint8)
    image[:] = (encoding.neutral, encoding.neutral, 0, 255)
    for region, frame in zip(sheet.regions, frames, strict=True):
        if region.page == page:
            place = _place(sheet, region, edges.margin)
            vectors = _vectors(frame, region, place, sheet.scale)
            if sheet.grid is not None:
                vectors = _shortened(vectors, place, _owned(region, edges.extrude))
            part = slice(place.y, place.y + place.height), slice(place.x, place.x + place.width)
            image[part][..., :2] = encoding.encode(as_plane(vectors / unit))
    return image


def _place(sheet: AtlasSheet, region: Region, margin: int) -> Rect:
    """Return the part of the page that a frame's vectors fill."""
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
    """Return where the page shows the frame and what repeats its edge."""
    return Rect(
        region.x - extrude,
        region.y - extrude,
        region.width + 2 * extrude,
        region.height + 2 * extrude,
    )


def _vectors(frame: FrameMotion, region: Region, place: Rect, scale: float) -> Vectors:
    """Return the vectors at the pixels of ``place`` on the page, px of the page a frame.

    Beyond the frame they are as at its edge.
    """
    motion = frame.motion
    small = motion.cells[frame.number].astype(np.float32)
    height, width = small.shape[:2]
    x = np.arange(place.width, dtype=np.float32) + (place.x + 0.5 - region.x + region.trim_x)
    y = np.arange(place.height, dtype=np.float32) + (place.y + 0.5 - region.y + region.trim_y)
    column, row = np.meshgrid(
        x * np.float32(width / (scale * motion.width)) - np.float32(0.5),
        y * np.float32(height / (scale * motion.height)) - np.float32(0.5),
    )
    return as_plane(sample_at(small, column, row) * np.float32(scale))


def _shortened(vectors: Vectors, place: Rect, frame: Rect) -> Vectors:
    """Shorten vectors of ``place`` on the page that would lead a sample out of ``frame``.

    An engine goes along a vector in the one frame and against it in the other, so that either way
    has to stay where there is something of this frame, not of a neighbour.
    """
    x = np.arange(place.width, dtype=np.float32) + (place.x - frame.x)
    y = np.arange(place.height, dtype=np.float32) + (place.y - frame.y)
    for axis, along, length in ((0, x[None, :], frame.width), (1, y[:, None], frame.height)):
        room = np.maximum(np.minimum(along, length - 1 - along), 0)
        vectors[..., axis] = np.clip(vectors[..., axis], -room, room)
    return vectors
