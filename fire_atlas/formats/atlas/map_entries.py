"""What lies beside the pages, as JSON says it: ``meta.maps``."""

from typing import Any

from fire_atlas.atlas.layout import AtlasSheet, MotionReading
from fire_atlas.formats.decimals import plain


def map_entries(sheet: AtlasSheet, page: int) -> list[dict[str, Any]]:
    """Return the images beside a page."""
    return [
        {
            "kind": each.kind,
            "image": each.files[page],
            **({} if each.motion is None else motion_entry(each.motion, sheet.fps)),
        }
        for each in sheet.maps
    ]


def motion_entry(reading: MotionReading, fps: float) -> dict[str, Any]:
    """Return how motion vectors are read: channels, formula, and how strong they are."""
    return {
        "engine": reading.engine,
        "red": "right",
        "green": reading.green,
        "srgb": False,
        "neutral": reading.neutral,
        "decode": reading.decode,
        "scale": plain(reading.scale, 9),
        "unit": reading.unit,
        "this": reading.this,
        "next": reading.following,
        "strength": strengths(reading, fps),
        "reach": _pair(reading.reach, 3),
        "gutter": reading.gutter and list(reading.gutter),
    }


def strengths(reading: MotionReading, fps: float) -> dict[str, Any]:
    """Return what a decoded 1 means in the units that tools call "strength", along x and y.

    Without cells there is nothing to count in UV.
    """
    cell = reading.cell_uv
    return {
        "cellUv": cell and _pair(cell, 9),
        "pixels": _pair(reading.pixels, 6),
        "cellUvPerSecond": cell and _pair((cell[0] * fps, cell[1] * fps), 9),
    }


def _pair(values: tuple[float, float], digits: int) -> list[float]:
    return [plain(values[0], digits), plain(values[1], digits)]
