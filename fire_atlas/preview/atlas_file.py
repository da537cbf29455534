"""A written atlas, read back: what every page and frame is, and the frames cut out again."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from fire_atlas.core.errors import RecipeError, SourceError
from fire_atlas.core.pixels import Bytes


@dataclass(frozen=True, slots=True)
class PageFile:
    """A page: its image and its size in px."""

    image: Path
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class FrameEntry:
    """A frame as the atlas describes it; px, y down.

    Attributes:
        name: Its name in the atlas.
        page: Index of its page.
        x, y, width, height: Its trimmed pixels on the page.
        trim_x, trim_y: Their top-left corner in the untrimmed frame.
        full_width, full_height: The untrimmed frame.
        duration: Milliseconds.
    """

    name: str
    page: int
    x: int
    y: int
    width: int
    height: int
    trim_x: int
    trim_y: int
    full_width: int
    full_height: int
    duration: float

    @property
    def is_trimmed(self) -> bool:
        """Whether borders were cut off."""
        return (self.width, self.height) != (self.full_width, self.full_height)


@dataclass(frozen=True, slots=True)
class AtlasFile:
    """A whole atlas.

    Attributes:
        path: Its (first) JSON file.
        alpha: ``straight``, ``premultiplied`` or ``additive``.
        blend_space: ``srgb`` or ``linear``: where its client blends.
        pages: Its pages.
        animations: Name of each animation → its frames in playing order.
    """

    path: Path
    alpha: str
    blend_space: str
    pages: tuple[PageFile, ...]
    animations: dict[str, tuple[FrameEntry, ...]]

    @property
    def frames(self) -> tuple[FrameEntry, ...]:
        """The frames of all animations, one animation after the other."""
        return tuple(frame for frames in self.animations.values() for frame in frames)


def read_atlas(path: Path) -> AtlasFile:
    """Read ``path`` (TexturePacker JSON hash) and the files of its further pages."""
    first = _read_json(path)
    try:
        siblings = [_beside(path, name) for name in first["meta"].get("related_multi_packs", [])]
        documents = [first, *map(_read_json, siblings)]
        pages = tuple(_page(path, document["meta"]) for document in documents)
        animations: dict[str, tuple[FrameEntry, ...]] = {}
        for page, document in enumerate(documents):
            for name, frames in document["animations"].items():
                entries = (_entry(frame, page, document["frames"][frame]) for frame in frames)
                animations[name] = (*animations.get(name, ()), *entries)
        if not any(animations.values()):
            raise ValueError("it has no frames")
        about = first["meta"]["fireAtlas"]
        return AtlasFile(path, about["alpha"], about["blendSpace"], pages, animations)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise SourceError(
            f"{path}: is no atlas that fire-atlas wrote ({type(error).__name__}: {error});"
            " name the .json beside the pages"
        ) from error


def cut_frames(atlas: AtlasFile) -> Iterator[Bytes]:
    """Yield every frame at its full size, (H, W, 4) uint8 RGBA as stored, in playing order."""
    pages: dict[int, Bytes] = {}
    for frame in atlas.frames:
        if frame.page not in pages:
            pages = {frame.page: _read_page(atlas.pages[frame.page])}
        yield _cut(pages[frame.page], frame, atlas.path)


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


def _page(path: Path, meta: dict[str, Any]) -> PageFile:
    return PageFile(_beside(path, meta["image"]), int(meta["size"]["w"]), int(meta["size"]["h"]))


def _entry(name: str, page: int, frame: dict[str, Any]) -> FrameEntry:
    place, trim, full = frame["frame"], frame["spriteSourceSize"], frame["sourceSize"]
    return FrameEntry(
        name, page,
        int(place["x"]), int(place["y"]), int(place["w"]), int(place["h"]),
        int(trim["x"]), int(trim["y"]),
        int(full["w"]), int(full["h"]),
        float(frame["duration"]),
    )  # fmt: skip


def _read_page(page: PageFile) -> Bytes:
    try:
        data = np.fromfile(page.image, np.uint8)
    except OSError as error:
        raise SourceError(f"{page.image}: the page cannot be read ({error.strerror})") from None
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if len(data) else None
    if image is None or image.ndim != 3 or image.shape[2] != 4 or image.dtype != np.uint8:
        raise SourceError(f"{page.image}: is no 8-bit RGBA image; build the recipe again")
    if image.shape[:2] != (page.height, page.width):
        raise SourceError(
            f"{page.image}: is {image.shape[1]}x{image.shape[0]}, but the atlas says "
            f"{page.width}x{page.height}; build the recipe again"
        )
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGRA2RGBA), np.uint8)


def _cut(page: Bytes, frame: FrameEntry, path: Path) -> Bytes:
    full = np.zeros((frame.full_height, frame.full_width, 4), np.uint8)
    cell = _window(page, frame.x, frame.y, frame)
    target = _window(full, frame.trim_x, frame.trim_y, frame)
    if cell.shape != target.shape or cell.shape[:2] != (frame.height, frame.width):
        raise SourceError(f"{path}: {frame.name} lies outside of its page or of its own frame")
    target[:] = cell
    return full


def _window(image: Bytes, x: int, y: int, frame: FrameEntry) -> Bytes:
    """Return the part of ``image`` at (x, y), of the frame's size; empty for negative places."""
    return image[y : y + frame.height, x : x + frame.width] if min(x, y) >= 0 else image[:0, :0]
