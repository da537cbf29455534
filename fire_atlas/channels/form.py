"""Draw the form of a fire: the direction that its front faces, and how near that is."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.compressed import CompressedImage
from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import light_images
from fire_atlas.atlas.sheet import AtlasSheet, Rect
from fire_atlas.core.clip import Form
from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.recipe.output import FormMap

DEPTH_DECODE = "(r * 255 - 128) / 127"
"""Formula that turns a sample, 0..1, into a part of the range, -1..1."""

_AROUND = 8
"""Width of the form that is kept around what is visible, px, for filters."""

_ZERO, _SPAN = 128, 127
"""Byte that means no depth, and steps from there to the end of the range."""


def form_sprites(
    form: Form, lit: Rect | None, scales: Sequence[float]
) -> tuple[CompressedImage, ...]:
    """Return the form of a frame for the pages of each scale, half floats: the normal's parts
    right, down and towards the viewer, and the depth in px at full size.

    ``lit`` is what is visible of the frame; the form further away is left out.
    """
    whole = np.zeros((*form.depth.shape, 4), np.float32)
    if lit is not None:
        part = (
            slice(max(lit.y - _AROUND, 0), lit.y + lit.height + _AROUND),
            slice(max(lit.x - _AROUND, 0), lit.x + lit.width + _AROUND),
        )
        whole[part] = np.dstack([form.normal, form.depth])[part]
    return light_images(whole, scales)


def deepest(sprites: Iterable[CompressedImage]) -> float:
    """Return the largest depth, before or behind the foot of the fire, px."""
    depths = (sprite.image[..., 3] for sprite in sprites)
    return max((float(np.abs(each).max(initial=0)) for each in depths), default=0.0)


def draw_form_page(
    sheet: AtlasSheet, page: int, sprites: Sequence[CompressedImage], edges: Edges, kind: FormMap
) -> Bytes:
    """Draw one page, (H, W, 4) uint8, of the form of each region's frame, in order.

    ``normals``: red is right, green up and blue towards the viewer, from -1 to 1. ``depth``: grey,
    towards the viewer, from minus the map's ``reach`` to it. Alpha is 255, because importers may
    change colours that are transparent.
    """
    unbled = Edges(edges.extrude, 0, edges.margin)
    drawn = as_plane(draw_page(sheet, page, sprites, unbled, np.float16))
    image = np.full(drawn.shape, 255, np.uint8)
    if kind == "normals":
        image[..., :3] = _normal_bytes(drawn[..., :3])
        return image
    image[..., :3] = _depth_bytes(drawn[..., 3] * np.float32(sheet.scale), sheet)[..., None]
    return image


def _depth_bytes(depth: Plane, sheet: AtlasSheet) -> NDArray[np.uint8]:
    """Return depths (H, W), px of the sheet, as bytes."""
    reach = sheet.map("depth").reach
    assert reach is not None, "depth is drawn where the sheet has its range"
    share = np.clip(depth / np.float32(reach), -1, 1)
    return np.asarray(np.rint(share * _SPAN + _ZERO), np.uint8)


def _normal_bytes(vectors: NDArray[np.float32]) -> Bytes:
    """Return unit vectors (H, W, 3) along ``vectors``, y down, as bytes, y up; towards the viewer
    where there are none."""
    length = np.sqrt((vectors * vectors).sum(axis=2, keepdims=True))
    level = np.array([0, 0, 1], np.float32)
    unit = np.where(length > 0, vectors / np.maximum(length, np.float32(1e-6)), level)
    upright = unit * np.array([1, -1, 1], np.float32)
    # Halves are rounded up, so that 0 is 128 as in other normal maps.
    return np.asarray(np.floor(upright * 127.5 + 128), np.uint8)
