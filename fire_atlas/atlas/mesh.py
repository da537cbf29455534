"""Give each frame of a sheet a tight polygon, so that renderers draw fewer empty pixels."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.outline import outline
from fire_atlas.atlas.polygon import triangulated
from fire_atlas.atlas.sheet import AtlasSheet, Mesh, Rect, Region, Sprite
from fire_atlas.atlas.trim import crop, visible_pixels


def with_meshes(
    sheet: AtlasSheet,
    frames: Sequence[Sequence[Sprite]],
    vertices: int,
    *,
    threshold: int = 0,
    margin: int = 0,
    done: Callable[[], object] = lambda: None,
) -> AtlasSheet:
    """Return a sheet whose frames and single sprites have meshes; of a nine-patch all is drawn.

    Args:
        sheet: The sheet.
        frames: Of each frame, then each single sprite, what the page and its maps show of it.
        vertices: Maximum number of vertices of a mesh.
        threshold: Pixels count as visible if their alpha or light is above this, of 255.
        margin: Empty px kept around what is visible.
        done: Called after each frame.
    """
    meshes: dict[tuple[int, int, int, bool], Mesh] = {}
    regions = []
    for region, sprites in zip((*sheet.regions, *sheet.singles), frames, strict=True):
        place = region.page, region.x, region.y, region.border is None
        if place not in meshes:  # frames with the same pixels share it
            visible = _visible(region, sprites, threshold, margin, sheet.alpha == "straight")
            meshes[place] = _mesh(outline(visible, vertices))
        regions.append(replace(region, mesh=meshes[place]))
        done()
    played = len(sheet.regions)
    return replace(sheet, regions=tuple(regions[:played]), singles=tuple(regions[played:]))


def _visible(
    region: Region, sprites: Sequence[Sprite], threshold: int, margin: int, is_straight: bool
) -> NDArray[np.bool_]:
    """Return which pixels of a trimmed frame (H, W) must be drawn."""
    if region.border is not None:
        return np.ones((region.height, region.width), np.bool_)
    rect = Rect(region.trim_x, region.trim_y, region.width, region.height)
    visible = np.zeros((region.height, region.width), np.bool_)
    for sprite in sprites:
        visible |= visible_pixels(crop(sprite, rect), threshold, is_straight=is_straight)
    if not margin:
        return visible
    around = np.ones((2 * margin + 1, 2 * margin + 1), np.uint8)
    return cv2.dilate(visible.view(np.uint8), around).astype(np.bool_)


def _mesh(polygon: Sequence[tuple[int, int]]) -> Mesh:
    return Mesh(tuple(polygon), triangulated(polygon))
