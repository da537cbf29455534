"""Which maps lie beside the pages of a sheet, and how strong the vectors are there."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

from fire_atlas.atlas.sheet import AtlasSheet, MotionScale, SheetMap
from fire_atlas.channels.encoding import MotionEncoding
from fire_atlas.channels.motion import Motion
from fire_atlas.recipe.output import Layer

_LEAST = 0.5
"""Smallest scale, px: below it there is no motion worth more digits."""

_DIGITS = 4
"""Digits of a scale: people copy it."""


def margin_of(motions: Iterable[Motion]) -> int:
    """Return how far a sample may lie from its pixel, px: what has to be kept around a frame."""
    return math.ceil(max((max(motion.reach) for motion in motions), default=0))


def with_maps(
    sheet: AtlasSheet,
    layers: Sequence[Layer],
    motions: Sequence[Motion],
    encoding: MotionEncoding | None,
) -> AtlasSheet:
    """Return ``sheet`` with what lies beside its pages; one scale for all ``motions`` on them."""
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
    x, y = (max(motion.reach[axis] for motion in motions) for axis in (0, 1))
    reach = max(x, _LEAST) * sheet.scale, max(y, _LEAST) * sheet.scale
    cell = (sheet.grid.cell_width, sheet.grid.cell_height) if sheet.grid else None
    unit = encoding.unit_pixels(cell)
    scale = _rounded_up(max(reach[0] / unit[0], reach[1] / unit[1]))
    pixels = scale * unit[0], scale * unit[1]
    return MotionScale(
        engine=encoding.engine,
        scale=scale,
        pixels=pixels,
        cell_uv=(pixels[0] / cell[0], pixels[1] / cell[1]) if cell else None,
        reach=reach,
        gutter=_gutter(sheet),
    )


def _gutter(sheet: AtlasSheet) -> tuple[int, int] | None:
    """Return the narrower side of what lies around the frames in their cells, along x and y."""
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
    """Return ``value`` in so many digits that people can copy it, not less than it was."""
    step = 10.0 ** (math.floor(math.log10(value)) + 1 - _DIGITS)
    return round(math.ceil(value / step - 1e-9) * step, 12)
