"""Draw atlas pages: each frame at its place, with extruded edges and colour bleed."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import DTypeLike, NDArray

from fire_atlas.atlas.sheet import AtlasSheet, PlacedImage, Rect, Region
from fire_atlas.atlas.trim import crop
from fire_atlas.core.workers import Workers
from fire_atlas.recipe.output import Atlas


@dataclass(frozen=True, slots=True)
class Edges:
    """Space around a frame on its page, px.

    Attributes:
        extrude: Width of the border that repeats the frame's outermost pixels.
        bleed: Distance up to which transparent pixels get the colour of a visible one.
        margin: Width beyond the extruded frame in which no other frame draws.
    """

    extrude: int
    bleed: int
    margin: int

    @classmethod
    def of(cls, settings: Atlas, scale: float) -> Self:
        """Convert the recipe's settings to px of a sheet of that scale."""
        return cls(
            extrude=math.ceil(settings.extrude * scale),
            bleed=math.ceil(settings.bleed * scale),
            margin=int(settings.padding * scale) // 2,
        )


def draw_page(
    sheet: AtlasSheet,
    page: int,
    sprites: Sequence[PlacedImage],
    edges: Edges,
    dtype: DTypeLike = np.uint8,
    workers: Workers | None = None,
) -> NDArray[Any]:
    """Draw one page, (H, W, 4) of ``dtype``.

    Args:
        sheet: The sheet.
        page: Index of the page.
        sprites: Those of the sheet's regions, in order, and after them of its single sprites and
            cells, if they are to be on this image.
        edges: Space around a frame on its page.
        dtype: Type of the page and of the sprites.
        workers: Draw several frames at a time; without them, one after the other.
    """
    size = sheet.pages[page].height, sheet.pages[page].width
    image = np.zeros((*size, 4), dtype)
    placed: dict[tuple[int, int], tuple[Region, PlacedImage]] = {}
    for region, sprite in zip(sheet.placed, sprites, strict=False):
        if region.page == page:
            placed.setdefault((region.x, region.y), (region, sprite))

    def draw(each: tuple[Region, PlacedImage]) -> None:
        _draw(image, *each, edges)

    deque((workers.map if workers else map)(draw, placed.values()), maxlen=0)
    return image


def _draw(page: NDArray[Any], region: Region, sprite: PlacedImage, edges: Edges) -> None:
    frame = crop(sprite, Rect(region.trim_x, region.trim_y, region.width, region.height))
    if region.rotated:
        frame = np.rot90(frame, -1)
    if edges.extrude:
        frame = np.pad(frame, ((edges.extrude,) * 2, (edges.extrude,) * 2, (0, 0)), mode="edge")
    x, y = region.x - edges.extrude, region.y - edges.extrude
    if edges.bleed:
        reach = min(edges.bleed, edges.margin)
        frame = bleed_colour(np.pad(frame, ((reach, reach), (reach, reach), (0, 0))), edges.bleed)
        x, y = x - reach, y - reach
    _paste(page, frame, x, y)


def _paste(page: NDArray[Any], image: NDArray[Any], x: int, y: int) -> None:
    """Copy ``image`` onto ``page`` at (x, y), clipped to the page."""
    left, top = max(-x, 0), max(-y, 0)
    right, bottom = page.shape[1] - x, page.shape[0] - y
    seen = image[top:bottom, left:right]
    page[y + top : y + top + seen.shape[0], x + left : x + left + seen.shape[1]] = seen


def bleed_colour(image: NDArray[Any], reach: int) -> NDArray[Any]:
    """Return ``image`` (H, W, 4) with colour in its transparent pixels; alpha is unchanged.

    Those within ``reach`` px of a visible pixel get the colour of the nearest one.
    """
    hidden = image[..., 3] == 0
    if hidden.all() or not hidden.any():
        return image
    distance, labels = cv2.distanceTransformWithLabels(
        hidden.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    colours = np.zeros((int(labels.max()) + 1, 3), image.dtype)
    colours[labels[~hidden]] = image[..., :3][~hidden]
    near = hidden & (distance <= reach)
    image = image.copy()
    image[..., :3][near] = colours[labels[near]]
    return image
