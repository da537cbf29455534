"""Draw a page of motion vectors in the layout of a page of frames."""

from collections.abc import Sequence

import cv2
import numpy as np

from fire_atlas.atlas.drawing import Edges
from fire_atlas.atlas.sheet import AtlasSheet, Box, Region
from fire_atlas.channels.encoding import MotionEncoding
from fire_atlas.channels.flow import Vectors
from fire_atlas.channels.motion import Moving
from fire_atlas.core.pixels import Bytes, as_plane


def draw_motion_page(
    sheet: AtlasSheet, page: int, frames: Sequence[Moving], encoding: MotionEncoding, edges: Edges
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
    for region, moving in zip(sheet.regions, frames, strict=True):
        if region.page == page:
            place = _place(sheet, region, edges.margin)
            vectors = _vectors(moving, region, place, sheet.scale)
            if sheet.grid is not None:
                vectors = _kept_in(vectors, place, _owned(region, edges.extrude))
            part = slice(place.y, place.y + place.height), slice(place.x, place.x + place.width)
            image[part][..., :2] = encoding.encode(as_plane(vectors / unit))
    return image


def _place(sheet: AtlasSheet, region: Region, margin: int) -> Box:
    """Return the part of the page that a frame's vectors fill."""
    grid = sheet.grid
    if grid is not None:
        x, y = (
            region.x // grid.cell_width * grid.cell_width,
            region.y // grid.cell_height * grid.cell_height,
        )
        return Box(x, y, grid.cell_width, grid.cell_height)
    page = sheet.pages[region.page]
    x, y = max(region.x - margin, 0), max(region.y - margin, 0)
    right = min(region.x + region.width + margin, page.width)
    bottom = min(region.y + region.height + margin, page.height)
    return Box(x, y, right - x, bottom - y)


def _owned(region: Region, extrude: int) -> Box:
    """Return where the page shows the frame and what repeats its edge."""
    return Box(
        region.x - extrude,
        region.y - extrude,
        region.width + 2 * extrude,
        region.height + 2 * extrude,
    )


def _vectors(moving: Moving, region: Region, place: Box, scale: float) -> Vectors:
    """Return the vectors at the pixels of ``place`` on the page, px of the page a frame.

    Beyond the frame they are as at its edge.
    """
    motion = moving.motion
    small = motion.cells[moving.frame].astype(np.float32)
    height, width = small.shape[:2]
    x = np.arange(place.width, dtype=np.float32) + (place.x + 0.5 - region.x + region.trim_x)
    y = np.arange(place.height, dtype=np.float32) + (place.y + 0.5 - region.y + region.trim_y)
    column, row = np.meshgrid(
        x * np.float32(width / (scale * motion.width)) - np.float32(0.5),
        y * np.float32(height / (scale * motion.height)) - np.float32(0.5),
    )
    found = cv2.remap(small, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return as_plane(found * np.float32(scale))


def _kept_in(vectors: Vectors, place: Box, frame: Box) -> Vectors:
    """Shorten vectors of ``place`` on the page that would lead a sample out of ``frame``.

    A client goes along a vector in the one frame and against it in the other, so that either way
    has to stay where there is something of this frame, not of a neighbour.
    """
    x = np.arange(place.width, dtype=np.float32) + (place.x - frame.x)
    y = np.arange(place.height, dtype=np.float32) + (place.y - frame.y)
    for axis, along, length in ((0, x[None, :], frame.width), (1, y[:, None], frame.height)):
        room = np.maximum(np.minimum(along, length - 1 - along), 0)
        vectors[..., axis] = np.clip(vectors[..., axis], -room, room)
    return vectors
