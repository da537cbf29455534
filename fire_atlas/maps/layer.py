"""Layers of the picture: the flame without flakes, the flakes alone, the smoke under both."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import encode_sprites
from fire_atlas.atlas.sheet import AtlasSheet, SheetMap, Sprite
from fire_atlas.core.workers import Workers
from fire_atlas.maps.kinds import MapKind
from fire_atlas.maps.maker import FrameParts, Maker
from fire_atlas.recipe.models import Recipe

_DTYPES: dict[int, DTypeLike] = {8: np.uint8, 16: np.uint16}
"""Types of pages by their bits a channel."""


class _Layer(Maker):
    def of_frame(self, kind: MapKind, parts: FrameParts, recipe: Recipe) -> tuple[Sprite, ...]:
        atlas = recipe.atlas
        if kind.name == "flame":
            return encode_sprites(parts.flame, atlas, parts.cover(parts.flame))
        if kind.name == "flakes":
            flakes = parts.flakes()
            return encode_sprites(flakes, atlas, parts.cover(flakes))
        if parts.smoke is None:
            raise ValueError("smoke is apart where its map is made")
        # Smoke hides what is behind it, also where clients add the fire.
        alpha = "straight" if atlas.alpha == "straight" else "premultiplied"
        under = atlas.model_copy(update={"alpha": alpha})
        return encode_sprites(parts.smoke.pixels(atlas.blend_space), under)

    def draw(
        self,
        kind: MapKind,
        sheet: AtlasSheet,
        page: int,
        content: Sequence[Sprite],
        edges: Edges,
        workers: Workers,
    ) -> NDArray[Any]:
        return draw_sprites(sheet, page, content, edges, workers)

    def entry(self, stated: SheetMap, sheet: AtlasSheet) -> dict[str, Any]:
        if stated.kind != "smoke":
            return {}
        alpha = "straight" if sheet.alpha == "straight" else "premultiplied"
        return {"alpha": alpha, "under": True, "opticalDepth": "-log(1 - a)"}


def draw_sprites(
    sheet: AtlasSheet, page: int, sprites: Sequence[Sprite], edges: Edges, workers: Workers
) -> NDArray[Any]:
    """Draw one page, (H, W, 4) in the bits of the sheet, of ``sprites`` where it has its frames."""
    shown = [sprite.in_bits(sheet.bits) for sprite in sprites]
    return draw_page(sheet, page, shown, edges, _DTYPES[sheet.bits], workers)


MAKER = _Layer()
