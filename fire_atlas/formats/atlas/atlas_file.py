"""A written atlas, read back: what every page and frame is, and the frames cut out again."""

import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

from fire_atlas.atlas.layout import (
    Animation,
    AtlasSheet,
    Grid,
    MotionReading,
    Page,
    Region,
    SheetMap,
)
from fire_atlas.core.errors import RecipeError, SourceError
from fire_atlas.core.pixels import Bytes


@dataclass(frozen=True, slots=True)
class AtlasFile:
    """A whole atlas, and its (first) JSON file; pages lie beside that."""

    path: Path
    sheet: AtlasSheet

    @property
    def alpha(self) -> str:
        """``straight``, ``premultiplied`` or ``additive``."""
        return self.sheet.alpha

    @property
    def blend_space(self) -> str:
        """``srgb`` or ``linear``: where its client blends."""
        return self.sheet.blend_space

    @property
    def frames(self) -> tuple[Region, ...]:
        """The frames of all animations, one animation after the other."""
        return self.sheet.regions


def read_atlas(path: Path) -> AtlasFile:
    """Read ``path`` (TexturePacker JSON hash) and the files of its further pages."""
    first = _read_json(path)
    try:
        siblings = [_beside(path, name) for name in first["meta"].get("related_multi_packs", [])]
        return AtlasFile(path, _sheet(path, [first, *map(_read_json, siblings)]))
    except (
        KeyError, TypeError, AttributeError, ValueError, ArithmeticError, IndexError
    ) as error:  # fmt: skip
        raise SourceError(
            f"{path}: is no atlas that fire-atlas wrote ({type(error).__name__}: {error});"
            " name the .json beside the pages"
        ) from error


def _sheet(path: Path, documents: Sequence[dict[str, Any]]) -> AtlasSheet:
    """Return what the JSON of each page says, as it was when they were written."""
    meta = documents[0]["meta"]
    about = meta["fireAtlas"]
    played = _played(documents)
    regions = tuple(region for frames in played.values() for region in frames)
    if not regions:
        raise ValueError("it has no frames")
    stem = Path(_beside(path, meta["image"]).name).stem
    loops = about.get("loops", {})
    return AtlasSheet(
        name=stem,
        title=stem.partition("@")[0],
        scale=float(meta.get("scale", 1)),
        fps=float(about.get("fps") or 1000 / regions[0].duration),
        alpha=about["alpha"],
        blend_space=about["blendSpace"],
        image_format=Path(meta["image"]).suffix[1:],
        pages=tuple(_page(path, document["meta"]) for document in documents),
        regions=regions,
        animations=tuple(
            Animation(name, tuple(region.name for region in frames), bool(loops.get(name)))
            for name, frames in played.items()
        ),
        grid=_grid(about.get("grid")),
        maps=_maps(path, [document["meta"].get("maps", []) for document in documents]),
    )


def _played(documents: Sequence[dict[str, Any]]) -> dict[str, tuple[Region, ...]]:
    """Return the frames of each animation, joined over the pages, in playing order."""
    played: dict[str, tuple[Region, ...]] = {}
    for page, document in enumerate(documents):
        for name, frames in document["animations"].items():
            regions = (_region(frame, page, document["frames"][frame]) for frame in frames)
            played[name] = (*played.get(name, ()), *regions)
    return {name: tuple(sorted(frames, key=lambda r: r.name)) for name, frames in played.items()}


def cut_frames(atlas: AtlasFile) -> Iterator[Bytes]:
    """Yield every frame at its full size, (H, W, 4) uint8 RGBA as stored, in playing order."""
    pages: dict[int, Bytes] = {}
    for frame in atlas.frames:
        if frame.page not in pages:
            pages = {frame.page: _read_page(atlas.path, atlas.sheet.pages[frame.page])}
        yield _cut(pages[frame.page], frame, atlas.path)


def staged_frames(atlas: AtlasFile) -> Iterator[Bytes]:
    """Yield every frame on a canvas that holds all of them, their pivots in one place."""
    (width, height), places = stage(atlas.frames)
    for frame, (x, y) in zip(cut_frames(atlas), places, strict=True):
        canvas = np.zeros((height, width, 4), np.uint8)
        canvas[y : y + frame.shape[0], x : x + frame.shape[1]] = frame
        yield canvas


def stage(frames: Sequence[Region]) -> tuple[tuple[int, int], list[tuple[int, int]]]:
    """Return the size of a canvas that holds all ``frames`` with their pivots in one place, and
    where on it the top-left corner of each whole frame is, px."""
    pivots = [
        (round(f.anchor[0] * f.frame_width), round(f.anchor[1] * f.frame_height)) for f in frames
    ]
    left, top = max(x for x, _ in pivots), max(y for _, y in pivots)
    right = max(f.frame_width - x for f, (x, _) in zip(frames, pivots, strict=True))
    bottom = max(f.frame_height - y for f, (_, y) in zip(frames, pivots, strict=True))
    return (left + right, top + bottom), [(left - x, top - y) for x, y in pivots]


def _read_json(path: Path) -> dict[str, Any]:
    if path.suffix in {".yaml", ".yml"}:
        raise RecipeError(f"{path}: is a recipe; build it and name the .json it writes")
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise RecipeError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise SourceError(f"{path}: is no JSON ({error})") from None
    if not isinstance(document, dict) or not {"frames", "meta"} <= document.keys():
        raise SourceError(f"{path}: is no atlas (`frames` and `meta`); name the .json of a build")
    return document


def _beside(path: Path, name: str) -> Path:
    """Return the file ``name`` in the folder of ``path``: an atlas names no other folder's."""
    if Path(name).name != name:
        raise ValueError(f"{name!r} is no plain file name")
    return path.parent / name


def _page(path: Path, meta: dict[str, Any]) -> Page:
    size = meta["size"]
    safe_mip = meta["fireAtlas"].get("safeMipLevel") if "fireAtlas" in meta else None
    file = _beside(path, meta["image"]).name
    return Page(file, int(size["w"]), int(size["h"]), None if safe_mip is None else int(safe_mip))


def _grid(grid: dict[str, Any] | None) -> Grid | None:
    if grid is None:
        return None
    cell = int(grid["cellWidth"]), int(grid["cellHeight"])
    return Grid(int(grid["columns"]), int(grid["rows"]), *cell)


def _maps(path: Path, pages: Sequence[Sequence[dict[str, Any]]]) -> tuple[SheetMap, ...]:
    """Return what lies beside the pages; every page has the same kinds of it."""
    return tuple(
        SheetMap(
            str(entry["kind"]),
            tuple(_beside(path, page[i]["image"]).name for page in pages),
            _reading(entry) if entry["kind"] == "motion" else None,
        )
        for i, entry in enumerate(pages[0])
    )


def _reading(entry: dict[str, Any]) -> MotionReading:
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
        pixels=_pair(strength["pixels"]),
        cell_uv=None if strength["cellUv"] is None else _pair(strength["cellUv"]),
        reach=_pair(entry["reach"]),
        gutter=None if gutter is None else (int(gutter[0]), int(gutter[1])),
    )


def _pair(values: Sequence[Any]) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _region(name: str, page: int, frame: dict[str, Any]) -> Region:
    place, trim, full = frame["frame"], frame["spriteSourceSize"], frame["sourceSize"]
    anchor = frame.get("anchor", {"x": 0.5, "y": 0.5})
    return Region(
        name=name,
        page=page,
        x=int(place["x"]),
        y=int(place["y"]),
        width=int(place["w"]),
        height=int(place["h"]),
        turned=bool(frame.get("rotated")),
        trim_x=int(trim["x"]),
        trim_y=int(trim["y"]),
        frame_width=int(full["w"]),
        frame_height=int(full["h"]),
        anchor=(float(anchor["x"]), float(anchor["y"])),
        duration=float(frame["duration"]),
    )


def read_page_file(path: Path, page: Page) -> bytes:
    """Return the file of a page of the atlas ``path``, which is an image of the size it should be.

    Raises:
        SourceError: It is missing, or something else.
    """
    file = _beside(path, page.file)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise SourceError(f"{file}: the page cannot be read ({error.strerror})") from None
    try:
        with Image.open(io.BytesIO(data), formats=["PNG", "WEBP"]) as image:
            size = image.size
    except (OSError, Image.DecompressionBombError) as error:
        raise SourceError(f"{file}: is no PNG or WebP; build the recipe again") from error
    if size != (page.width, page.height):
        raise SourceError(
            f"{file}: is {size[0]}x{size[1]}, but the atlas says {page.width}x{page.height}; "
            f"build the recipe again"
        )
    return data


def _read_page(path: Path, page: Page) -> Bytes:
    file = _beside(path, page.file)
    data = np.frombuffer(read_page_file(path, page), np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    if image is None or image.dtype != np.uint8:
        raise SourceError(f"{file}: is no 8-bit image; build the recipe again")
    return _rgba(np.asarray(image, np.uint8))


def _rgba(image: Bytes) -> Bytes:
    """Return what OpenCV decoded as RGBA; a small file has no channels that say nothing."""
    if image.ndim == 2:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGBA), np.uint8)
    order = cv2.COLOR_BGRA2RGBA if image.shape[2] == 4 else cv2.COLOR_BGR2RGBA
    return np.asarray(cv2.cvtColor(image, order), np.uint8)


def _cut(page: Bytes, frame: Region, path: Path) -> Bytes:
    full = np.zeros((frame.frame_height, frame.frame_width, 4), np.uint8)
    cell = _window(page, frame.x, frame.y, *frame.page_size)
    if frame.turned:
        cell = np.rot90(cell)
    target = _window(full, frame.trim_x, frame.trim_y, frame.width, frame.height)
    if cell.shape != target.shape or cell.shape[:2] != (frame.height, frame.width):
        raise SourceError(f"{path}: {frame.name} lies outside of its page or of its own frame")
    target[:] = cell
    return full


def _window(image: Bytes, x: int, y: int, width: int, height: int) -> Bytes:
    """Return the part of ``image`` at (x, y); empty for negative places."""
    return image[y : y + height, x : x + width] if min(x, y) >= 0 else image[:0, :0]
