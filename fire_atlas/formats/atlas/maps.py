"""What lies beside the pages, as JSON says it: ``meta.maps``.

What is written is read by the function next to its writer.
"""

from collections.abc import Sequence
from typing import Any

from fire_atlas.atlas.layout import AtlasSheet, MotionReading, SheetMap
from fire_atlas.core.output_file import plain_name
from fire_atlas.formats.decimals import plain


def map_entries(sheet: AtlasSheet, page: int) -> list[dict[str, Any]]:
    """Return the images beside a page."""
    return [
        {
            "kind": each.kind,
            "image": each.files[page],
            **({} if each.motion is None else _motion_entry(each.motion, sheet.fps)),
        }
        for each in sheet.maps
    ]


def maps_of(pages: Sequence[Sequence[dict[str, Any]]]) -> tuple[SheetMap, ...]:
    """Return what lies beside the pages, from ``map_entries`` of each: all have the same kinds."""
    return tuple(
        SheetMap(
            str(entry["kind"]),
            tuple(plain_name(page[i]["image"]) for page in pages),
            _motion_of(entry) if entry["kind"] == "motion" else None,
        )
        for i, entry in enumerate(pages[0])
    )


def _motion_entry(reading: MotionReading, fps: float) -> dict[str, Any]:
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


def _motion_of(entry: dict[str, Any]) -> MotionReading:
    """Return how motion vectors are read, as ``_motion_entry`` wrote it."""
    strength, gutter = entry["strength"], entry["gutter"]
    return MotionReading(
        engine=str(entry["engine"]),
        green=str(entry["green"]),
        neutral=int(entry["neutral"]),
        decode=str(entry["decode"]),
        this=str(entry["this"]),
        following=str(entry["next"]),
        unit=str(entry["unit"]),
        scale=float(entry["scale"]),
        pixels=_pair_of(strength["pixels"]),
        cell_uv=None if strength["cellUv"] is None else _pair_of(strength["cellUv"]),
        reach=_pair_of(entry["reach"]),
        gutter=None if gutter is None else (int(gutter[0]), int(gutter[1])),
    )


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


def _pair_of(values: Sequence[Any]) -> tuple[float, float]:
    return float(values[0]), float(values[1])
