"""Write TexturePacker's JSON, one file per page, with frames as a hash or an array; read the hash.

PixiJS, Phaser and most engines read it. ``preview`` and ``inspect`` read the hash back. Aseprite's
JSON is the array with frames called "0", "1", ...
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from operator import sub
from pathlib import Path
from typing import Any

from fire_atlas.atlas.sheet import Animation, AtlasSheet, Region, StateGraph
from fire_atlas.core.checks import number, one_of, text
from fire_atlas.core.errors import OutputError, RecipeError, SourceError
from fire_atlas.core.files import MAX_JSON_BYTES, read_file
from fire_atlas.core.output_file import OutputFile, name_below, plain_name
from fire_atlas.formats.atlas.entries import (
    animations_on,
    bits_of,
    compact,
    frame_entry,
    grid_of,
    heat_of,
    maps_of,
    meta_entry,
    page_of,
    region_of,
    states_of,
    textures_of,
    variant_of,
)
from fire_atlas.formats.tables import EXPORTS
from fire_atlas.recipe.document import RECIPE_ENDINGS


def export_json_hash(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield the hash of each page: ``name.json``, ``name-1.json``, ..."""
    for page in range(len(sheet.pages)):
        text = _hash_text(sheet, page)
        yield OutputFile(sheet.file(page, EXPORTS["json"].ending), "atlas", text.encode())


def _hash_text(sheet: AtlasSheet, page: int) -> str:
    """Return the hash of a page with one frame per line, which is small and easy to diff."""
    regions = sheet.regions_of(page)
    frames = ",\n".join(
        f"{compact(region.name)}:{compact(frame_entry(region))}" for region in regions
    )
    meta = _linked_meta(sheet, page, regions, EXPORTS["json"].ending)
    return (
        f'{{"frames":{{\n{frames}\n}},\n'
        f'"animations":{compact(animations_on(sheet, regions))},\n'
        f'"meta":{compact(meta)}}}\n'
    )


def _linked_meta(
    sheet: AtlasSheet, page: int, regions: Sequence[Region], ending: str
) -> dict[str, Any]:
    """Return the ``meta`` block of a page; only the first links to the files of the others.

    PixiJS reads the list of every page that a game loads by name, and fails without it; for pages
    that name each other it waits for ever.
    """
    meta = meta_entry(sheet, page, regions)
    if len(sheet.pages) > 1:
        others = [] if page else range(1, len(sheet.pages))
        meta["related_multi_packs"] = [sheet.file(i, ending) for i in others]
    return meta


def export_json_array(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield the array of each page: ``name.array.json``, ``name-1.array.json``, ..."""
    for page in range(len(sheet.pages)):
        regions = sheet.regions_of(page)
        text = _array_text(sheet, page, regions, [region.name for region in regions])
        yield OutputFile(sheet.file(page, EXPORTS["json-array"].ending), "atlas", text.encode())


def _array_text(
    sheet: AtlasSheet, page: int, regions: Sequence[Region], names: Sequence[str]
) -> str:
    """Return the array of a page; ``names`` are the names of its frames in the file."""
    frames = ",\n".join(
        compact({"filename": name, **frame_entry(region)})
        for name, region in zip(names, regions, strict=True)
    )
    name_in_file = {region.name: name for name, region in zip(names, regions, strict=True)}
    animations = {
        animation: [name_in_file[frame] for frame in played]
        for animation, played in animations_on(sheet, regions).items()
    }
    meta = _linked_meta(sheet, page, regions, EXPORTS["json-array"].ending)
    return (
        f'{{"frames":[\n{frames}\n],\n'
        f'"animations":{compact(animations)},\n'
        f'"meta":{compact(meta)}}}\n'
    )


def export_aseprite(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.aseprite.json``, with frames called "0", "1", ... for Phaser's Aseprite loader.

    Raises:
        OutputError: There are several pages; that loader supports only one.
    """
    if len(sheet.pages) > 1:
        raise OutputError(
            f"aseprite describes one page, but {sheet.name} needs {len(sheet.pages)}; "
            f"raise atlas.max_size, or export phaser instead",
            key=("exports",),
        )
    names = [str(i) for i in range(len(sheet.regions))] + [cell.name for cell in sheet.cells]
    text = _array_text(sheet, 0, _in_whole_milliseconds(sheet), names)
    yield OutputFile(sheet.file(0, EXPORTS["aseprite"].ending), "atlas", text.encode())


def _in_whole_milliseconds(sheet: AtlasSheet) -> list[Region]:
    """Return the frames on the pages with durations as Aseprite writes them, which typed readers
    want. Each frame of an animation ends within half a millisecond of its time."""
    whole = dict[str, int]()
    durations = {region.name: region.duration for region in sheet.regions}
    for animation in sheet.animations:
        ends = [round(end) for end in accumulate(durations[name] for name in animation.frames)]
        whole |= zip(animation.frames, map(sub, ends, [0, *ends]), strict=True)
    return [
        replace(region, duration=whole.get(region.name, round(region.duration)))
        for region in sheet.placed
    ]


@dataclass(frozen=True, slots=True)
class AtlasFile:
    """An atlas read from its files: the path of its first JSON file, and what that describes."""

    path: Path
    sheet: AtlasSheet

    @property
    def frames(self) -> tuple[Region, ...]:
        """The frames of all animations in playing order, one animation after the other."""
        return self.sheet.regions


def read_atlas(path: Path) -> AtlasFile:
    """Read the JSON of the first page of an atlas, and those of its further pages beside it.

    Raises:
        RecipeError: The file cannot be read, or is a recipe.
        SourceError: It is not a JSON hash written by this tool.
    """
    first = _read_json(path)
    try:
        names = first["meta"].get("related_multi_packs", [])
        others = [_read_json(path.parent / plain_name(name)) for name in names]
        return AtlasFile(path, _sheet(path.stem, [first, *others]))
    except (
        KeyError, TypeError, AttributeError, ValueError, ArithmeticError, IndexError
    ) as error:  # fmt: skip
        raise SourceError(
            f"{path}: is not an atlas that fire-atlas wrote ({type(error).__name__}: {error});"
            " give the .json beside the pages"
        ) from error


def _read_json(path: Path) -> dict[str, Any]:
    if path.suffix in RECIPE_ENDINGS:
        raise RecipeError(f"{path}: is a recipe; build it and give the .json that the build writes")
    try:
        document = json.loads(read_file(path, MAX_JSON_BYTES))
    except OSError as error:
        raise RecipeError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise SourceError(f"{path}: is not JSON ({error})") from None
    if not isinstance(document, dict) or not {"frames", "meta"} <= document.keys():
        raise SourceError(
            f"{path}: is not an atlas (it lacks `frames` or `meta`); give the .json of a build"
        )
    return document


def _sheet(name: str, documents: Sequence[dict[str, Any]]) -> AtlasSheet:
    """Return the sheet ``name`` described by ``documents``, the JSON of each page."""
    meta = documents[0]["meta"]
    about = meta["fireAtlas"]
    loops = about.get("loops", {})
    played = _played(documents, loops)
    regions = tuple(region for frames in played.values() for region in frames)
    others = _not_played(documents)
    singles = tuple(region for region in others if not region.duration)
    if not (regions or singles):
        raise ValueError("it has no frames")
    return AtlasSheet(
        name=name,
        title=name.partition("@")[0],
        scale=number(float(meta.get("scale", 1)), 0.001, 1),
        fps=_fps(about, regions),
        alpha=one_of(about["alpha"], ("straight", "premultiplied", "additive")),
        thins=one_of(about.get("cover", "full"), ("auto", "full")) == "auto",
        blend_space=one_of(about["blendSpace"], ("srgb", "linear")),
        image_format=Path(name_below(meta["image"])).suffix[1:],
        pages=tuple(page_of(document["meta"]) for document in documents),
        regions=regions,
        animations=tuple(
            Animation(
                text(name),
                tuple(region.name for region in frames),
                bool(loops.get(name)),
                variant_of(about, name),
            )
            for name, frames in played.items()
        ),
        grid=grid_of(about),
        maps=maps_of([document["meta"].get("maps", []) for document in documents]),
        states=_states(meta, {name: len(frames) for name, frames in played.items()}),
        singles=singles,
        cells=tuple(region for region in others if region.duration),
        bits=bits_of(meta),
        gpu=textures_of([document["meta"].get("gpu", []) for document in documents]),
        heat=heat_of(about),
    )


def _fps(about: dict[str, Any], regions: Sequence[Region]) -> float:
    """Return the frames per second of the first animation; 0 without one."""
    if not regions:
        return 0.0
    return number(float(about.get("fps") or 1000 / regions[0].duration), 0.001, 1e6)


def _not_played(documents: Sequence[dict[str, Any]]) -> tuple[Region, ...]:
    """Return the frames that no animation plays: single sprites, which have no duration, and the
    cells of textures of flakes."""
    played = {
        name
        for document in documents
        for frames in document["animations"].values()
        for name in frames
    }
    return tuple(
        region_of(name, page, entry)
        for page, document in enumerate(documents)
        for name, entry in document["frames"].items()
        if name not in played
    )


def _states(meta: dict[str, Any], frames: Mapping[str, int]) -> StateGraph | None:
    return states_of(meta["states"], frames) if "states" in meta else None


def _played(
    documents: Sequence[dict[str, Any]], order: Iterable[str]
) -> dict[str, tuple[Region, ...]]:
    """Return the frames of each animation from all pages, in playing order.

    ``order`` names all animations; the JSON of a page has only those with frames on it.
    """
    played: dict[str, tuple[Region, ...]] = dict.fromkeys(order, ())
    for page, document in enumerate(documents):
        for name, frames in document["animations"].items():
            regions = (region_of(frame, page, document["frames"][frame]) for frame in frames)
            played[name] = (*played.get(name, ()), *regions)
    return {
        name: tuple(sorted(frames, key=lambda region: region.name))
        for name, frames in played.items()
        if frames
    }
