"""Draw the form of a fire: the direction that its front faces, and how near that is."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.compressed import CompressedImage
from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import light_images
from fire_atlas.atlas.sheet import AtlasSheet, Rect, SheetMap
from fire_atlas.core.clip import FrontSurface
from fire_atlas.core.decimals import plain
from fire_atlas.core.pixels import Bytes, Plane, as_plane
from fire_atlas.core.workers import Workers
from fire_atlas.maps.kinds import MapKind
from fire_atlas.maps.maker import FrameParts, Maker, MappedAnimation, files_of
from fire_atlas.maps.vectors.page import MIN_LONGEST, rounded_up, strength
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Maps

DEPTH_DECODE = "(r * 255 - 128) / 127"
"""Formula that turns a sample, 0..1, into a part of the range, -1..1."""

_AROUND = 8
"""Width of the form that is kept around what is visible, px, for filters."""

_ZERO, _SPAN = 128, 127
"""Byte that means no depth, and steps from there to the end of the range."""


class _Form(Maker):
    def of_frame(
        self, kind: MapKind, parts: FrameParts, recipe: Recipe
    ) -> tuple[CompressedImage, ...]:
        if "form" not in parts.shared:
            parts.shared["form"] = form_sprites(parts.form, parts.visible, recipe.atlas.scales)
        found: tuple[CompressedImage, ...] = parts.shared["form"]
        return found

    def described(
        self, kind: MapKind, sheet: AtlasSheet, animations: Sequence[MappedAnimation], maps: Maps
    ) -> SheetMap:
        stated = files_of(kind, sheet)
        if kind.name != "depth":
            return stated
        deepest = _deepest(self.content(kind, animations, 0))
        return replace(stated, white=rounded_up(max(deepest, MIN_LONGEST) * sheet.scale))

    def draw(
        self,
        kind: MapKind,
        sheet: AtlasSheet,
        page: int,
        content: Sequence[CompressedImage],
        edges: Edges,
        workers: Workers,
    ) -> Bytes:
        """Draw one page, (H, W, 4) uint8.

        ``normals``: red is right, green up and blue towards the viewer, from -1 to 1. ``depth``:
        grey, towards the viewer, from minus what white means to it. Alpha is 255, because importers
        may change colours that are transparent.
        """
        unbled = Edges(edges.extrude, 0, edges.margin)
        drawn = as_plane(draw_page(sheet, page, content, unbled, np.float16, workers))
        image = np.full(drawn.shape, 255, np.uint8)
        if kind.name == "normals":
            image[..., :3] = _normal_bytes(drawn[..., :3])
            return image
        image[..., :3] = _depth_bytes(drawn[..., 3] * np.float32(sheet.scale), sheet)[..., None]
        return image

    def entry(self, stated: SheetMap, sheet: AtlasSheet) -> dict[str, Any]:
        if stated.white is None:
            channels = {"red": "right", "green": "up", "blue": "towards the viewer"}
            return {"srgb": False, **channels, "decode": "rgb * 2 - 1"}
        heights = {region.frame_height for region in sheet.regions}
        in_heights = plain(stated.white / heights.pop(), 6) if len(heights) == 1 else None
        return {
            "srgb": False,
            "decode": DEPTH_DECODE,
            "positive": "towards the viewer",
            "zero": "the foot of the fire",
            # In heights only if all frames are as high.
            "range": {"pixels": plain(stated.white, 6), "heights": in_heights},
        }

    def read(self, stated: SheetMap, entry: Mapping[str, Any]) -> SheetMap:
        if stated.kind != "depth":
            return stated
        return replace(stated, white=strength(entry["range"]["pixels"]))


MAKER = _Form()


def form_sprites(
    form: FrontSurface | None, visible: Rect | None, scales: Sequence[float]
) -> tuple[CompressedImage, ...]:
    """Return the form of a frame for the pages of each scale, half floats: the normal's parts
    right, down and towards the viewer, and the depth in px at full size.

    The form further away than a few px from what is ``visible`` of the frame is left out.

    Raises:
        ValueError: The fire has no form.
    """
    if form is None:
        raise ValueError("only fires with form have maps of it")
    whole = np.zeros((*form.depth.shape, 4), np.float32)
    if visible is not None:
        part = (
            slice(max(visible.y - _AROUND, 0), visible.y + visible.height + _AROUND),
            slice(max(visible.x - _AROUND, 0), visible.x + visible.width + _AROUND),
        )
        whole[part] = np.dstack([form.normal, form.depth])[part]
    return light_images(whole, scales)


def _deepest(sprites: Iterable[CompressedImage]) -> float:
    """Return the largest depth, before or behind the foot of the fire, px."""
    depths = (sprite.image[..., 3] for sprite in sprites)
    return max((float(np.abs(depth).max(initial=0)) for depth in depths), default=0.0)


def _depth_bytes(depth: Plane, sheet: AtlasSheet) -> NDArray[np.uint8]:
    """Return depths (H, W), px of the sheet, as bytes."""
    white = sheet.map("depth").white
    assert white is not None, "depth is drawn where the sheet has its range"
    share = np.clip(depth / np.float32(white), -1, 1)
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
