"""Emission: the light of a frame before it is exposed, for engines that render in HDR."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.compressed import CompressedImage
from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.encode import light_images
from fire_atlas.atlas.sheet import AtlasSheet, SheetMap
from fire_atlas.core.workers import Workers
from fire_atlas.maps.kinds import MapKind
from fire_atlas.maps.maker import FrameParts, Maker
from fire_atlas.recipe.models import Recipe

_ENTRY = {"srgb": False, "alpha": "premultiplied", "curve": "x/(1+x)"}
"""How a client reads light that may be brighter than white; the curve gives what the page shows."""


class _Emission(Maker):
    def of_frame(
        self, kind: MapKind, parts: FrameParts, recipe: Recipe
    ) -> tuple[CompressedImage, ...]:
        return light_images(parts.light(), recipe.atlas.scales)

    def draw(
        self,
        kind: MapKind,
        sheet: AtlasSheet,
        page: int,
        content: Sequence[CompressedImage],
        edges: Edges,
        workers: Workers,
    ) -> NDArray[Any]:
        # Premultiplied, so that filters need no colour beyond the edge.
        return draw_page(sheet, page, content, replace(edges, bleed=0), np.float16, workers)

    def entry(self, stated: SheetMap, sheet: AtlasSheet) -> dict[str, Any]:
        return _ENTRY


MAKER = _Emission()
