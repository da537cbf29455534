"""What lies beside the pages, as JSON says it: ``meta.maps``.

What is written is read by the function next to its writer.
"""

from collections.abc import Sequence
from typing import Any, get_args

from fire_atlas.atlas.sheet import AtlasSheet, MotionScale, SheetMap
from fire_atlas.channels.encoding import motion_encoding
from fire_atlas.core.output_file import plain_name
from fire_atlas.formats.checks import number, one_of, whole
from fire_atlas.formats.decimals import plain
from fire_atlas.recipe.output import Engine

_STRONGEST = 1e6
"""Most that a decoded 1 stands for, in any unit."""


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
            one_of(entry["kind"], ("motion", "flame", "flakes")),
            tuple(plain_name(page[i]["image"]) for page in pages),
            _motion_of(entry) if entry["kind"] == "motion" else None,
        )
        for i, entry in enumerate(pages[0])
    )


def _motion_entry(motion: MotionScale, fps: float) -> dict[str, Any]:
    """Return how motion vectors are read: channels, formula, and how strong they are."""
    encoding = motion_encoding(motion.engine)
    return {
        "engine": encoding.engine,
        "red": "right",
        "green": encoding.green,
        "srgb": False,
        "neutral": encoding.neutral,
        "decode": encoding.decode,
        "scale": plain(motion.scale, 9),
        "unit": encoding.unit,
        "this": encoding.this,
        "next": encoding.following,
        "strength": strengths(motion, fps),
        "reach": _pair(motion.longest, 3),
        "gutter": motion.gutter and list(motion.gutter),
    }


def _motion_of(entry: dict[str, Any]) -> MotionScale:
    """Return how strong motion vectors are; by the engine's name all else of them is known."""
    engine, strength, gutter = entry["engine"], entry["strength"], entry["gutter"]
    if engine not in get_args(Engine):
        raise ValueError(f"{engine!r} is no engine whose motion vectors are known")
    return MotionScale(
        engine=engine,
        scale=_strength(entry["scale"]),
        pixels=_pair_of(strength["pixels"]),
        cell_uv=None if strength["cellUv"] is None else _pair_of(strength["cellUv"]),
        longest=_pair_of(entry["reach"]),
        gutter=None if gutter is None else (whole(gutter[0]), whole(gutter[1])),
    )


def strengths(motion: MotionScale, fps: float) -> dict[str, Any]:
    """Return what a decoded 1 means in the units that tools call "strength", along x and y.

    Without cells there is nothing to count in UV.
    """
    cell = motion.cell_uv
    return {
        "cellUv": cell and _pair(cell, 9),
        "pixels": _pair(motion.pixels, 6),
        "cellUvPerSecond": cell and _pair((cell[0] * fps, cell[1] * fps), 9),
    }


def _pair(values: tuple[float, float], digits: int) -> list[float]:
    return [plain(values[0], digits), plain(values[1], digits)]


def _pair_of(values: Sequence[Any]) -> tuple[float, float]:
    return _strength(values[0]), _strength(values[1])


def _strength(value: Any) -> float:
    return number(value, -_STRONGEST, _STRONGEST)
