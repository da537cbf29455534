"""Haze: how far the hot air of a fire shifts what is seen through it.

Light bends towards denser air, as the refractive index of air exceeds 1 in proportion to its
density (Gladstone and Dale): what is seen is shifted along the density's gradient.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.drawing import Edges
from fire_atlas.atlas.sheet import AtlasSheet, Rect, SheetMap, VectorScale
from fire_atlas.core.context import BuildContext
from fire_atlas.core.pixels import Bytes, Plane, as_plane, magnitude
from fire_atlas.core.workers import Workers
from fire_atlas.effect.field.hot_air import thinness
from fire_atlas.maps.kinds import MapKind
from fire_atlas.maps.maker import AnimationParts, Maker, MappedAnimation, files_of
from fire_atlas.maps.vectors.encoding import HAZE_ENGINE, motion_encoding
from fire_atlas.maps.vectors.estimate import FrameVectors, longest_of
from fire_atlas.maps.vectors.page import (
    draw_vector_page,
    pair,
    pair_of,
    scale_entry,
    strength,
    vector_scale,
)
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Maps
from fire_atlas.vision.warp import between_copies

_STRENGTH = 7e-4
"""Shift where the density of the air changes by that of cold air in a frame height, heights."""

_EDGE = 0.08
"""Width along the borders of a frame over which haze fades to nothing, frame heights."""

_SEEN = 0.2
"""Shift from which haze is worth a place on the page, px."""


@dataclass(frozen=True, slots=True)
class Haze:
    """The haze of every frame of an animation, on the grid of its buoyancy field.

    Attributes:
        width, height: Size of the part of the frame that the grid covers, px: at least the frame.
        cells: One array per frame, (rows, columns, 2): where what is seen through the air at the
            middle of a cell really is, px to the right and down from there.
        longest: Maximum length of shifts along x and along y, px, without outliers.
        tiles: Whether the right side of a frame joins its left one.
    """

    width: int
    height: int
    cells: tuple[NDArray[np.float16], ...]
    longest: tuple[float, float]
    tiles: bool = False

    def frames(self) -> list[FrameVectors]:
        """Return the frames, in playing order."""
        size = self.width, self.height
        return [FrameVectors(cell, *size, tiles=self.tiles) for cell in self.cells]

    def seen(self, frame: int) -> Rect | None:
        """Return the rectangle of a frame in which haze is seen, px; None if nowhere."""
        shift = self.cells[frame].astype(np.float32)
        seen = magnitude(shift[..., 0], shift[..., 1]) > _SEEN
        rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
        if not rows.size:
            return None
        cell = self.height // len(shift)
        # Shifts are interpolated between the middles of cells.
        left, top = max(int(columns[0]) - 1, 0) * cell, max(int(rows[0]) - 1, 0) * cell
        right, bottom = (int(columns[-1]) + 2) * cell, (int(rows[-1]) + 2) * cell
        return Rect(left, top, right - left, bottom - top)


class _Haze(Maker):
    def of_animation(
        self, parts: AnimationParts, recipe: Recipe, context: BuildContext
    ) -> Haze | None:
        if parts.field is None or parts.study is None or parts.clip is None:
            return None
        if parts.study.segmentation.background is not None:
            context.progress.note(
                "maps.haze: the clip is an opaque scene, which hides what hot air would bend; "
                "source.matte: luminance makes its dark parts transparent"
            )
        with context.timer.measure("haze"):
            thin = thinness(parts.field, parts.clip.height, recipe.seed)
            played = islice(thin, parts.clip.count)  # without a dark end, fewer than the field's
            return haze_of(played, parts.study.kappa, parts.field.cell, tiles=parts.field.tiles)

    def seen(self, found: Haze, i: int) -> Rect | None:
        return found.seen(i)

    def described(
        self, kind: MapKind, sheet: AtlasSheet, animations: Sequence[MappedAnimation], maps: Maps
    ) -> SheetMap:
        longest = [animation.maps[kind.name].longest for animation in animations]
        scale = vector_scale(sheet, longest, motion_encoding(HAZE_ENGINE))
        # It shifts what is behind the page, so cells do not matter.
        return replace(files_of(kind, sheet), vectors=replace(scale, cell_uv=None, gutter=None))

    def content(
        self, kind: MapKind, animations: Sequence[MappedAnimation], scale: int
    ) -> list[FrameVectors]:
        return [frame for animation in animations for frame in animation.maps[kind.name].frames()]

    def draw(
        self,
        kind: MapKind,
        sheet: AtlasSheet,
        page: int,
        content: Sequence[FrameVectors],
        edges: Edges,
        workers: Workers,
    ) -> Bytes:
        return draw_vector_page(sheet, page, kind.name, content, edges)

    def entry(self, stated: SheetMap, sheet: AtlasSheet) -> dict[str, Any]:
        assert stated.vectors is not None
        return {
            **scale_entry(stated.vectors),
            "sample": "position + haze * scale",
            "reach": pair(stated.vectors.longest, 3),
        }

    def read(self, stated: SheetMap, entry: Mapping[str, Any]) -> SheetMap:
        scale, longest = strength(entry["scale"]), pair_of(entry["reach"])
        vectors = VectorScale(HAZE_ENGINE, scale, (scale, scale), None, longest, None)
        return replace(stated, vectors=vectors)


MAKER = _Haze()


def haze_of(thinness: Iterable[Plane], kappa: Plane, cell: int, *, tiles: bool = False) -> Haze:
    """Return the haze of an animation.

    Args:
        thinness: Of each frame, (rows, columns): how much less dense the air is than cold air.
        kappa: (H, W) height weight [κ], from 0 at the bottom of the flame to 1 at its top and
            above: hot air builds up on its way, and the ground beneath a fire stays as it is.
        cell: Side of a cell of the grid, px.
        tiles: Whether the right side of the air joins its left one.
    """
    unit, cells = np.float32(_STRENGTH * len(kappa) ** 2 / cell), list[NDArray[np.float16]]()
    margin = 1 if tiles else 0
    for thin in thinness:
        down, right = np.gradient(between_copies(as_plane(-thin), margin))
        around = np.stack([right, down], axis=2)
        shift = around[:, margin : margin + thin.shape[1]] * _weight(kappa, thin.shape, cell, tiles)
        cells.append((shift * unit).astype(np.float16))
    rows, columns = cells[0].shape[:2]
    return Haze(columns * cell, rows * cell, tuple(cells), longest_of(cells), tiles)


def _weight(kappa: Plane, shape: tuple[int, int], cell: int, tiles: bool) -> NDArray[np.float32]:
    """Return the factor of each cell's haze, (rows, columns, 1): κ, and 0 at the frame's border,
    but at the sides of a tile."""
    height, width = kappa.shape
    x, y = ((np.arange(count) + 0.5) * cell for count in (shape[1], shape[0]))
    edge = _EDGE * height
    across = np.ones_like(x) if tiles else np.clip(np.minimum(x, width - x) / edge, 0, 1)
    along = np.clip(np.minimum(y, height - y) / edge, 0, 1)
    centres = np.meshgrid(np.minimum(x, width - 1), np.minimum(y, height - 1))
    column, row = (centre.astype(np.intp) for centre in centres)
    inside = np.outer(along, across)
    return as_plane((kappa[row, column] * inside * inside * (3 - 2 * inside))[..., None])
