"""Cut the frames of an atlas out of its pages, as its JSON describes them.

Frames that are stored turned or trimmed are put back as they were. A page is decoded once, and only
one at a time is kept.
"""

from collections.abc import Generator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture, brightest, white
from fire_atlas.core.pixels import srgb_to_linear
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.sources.header import Header
from fire_atlas.sources.images import check_size, decode, read_header, shared_notes
from fire_atlas.sources.json_atlas import AtlasFrame, AtlasPage, read_animation
from fire_atlas.sources.reader import FrameReader, SequentialDecoder
from fire_atlas.sources.timing import Timing, time_drawings


def open_atlas(
    path: Path, animation: str | None, fps: float | None, max_pixels: int = MAX_PIXELS
) -> FrameReader:
    """Open an animation of the atlas whose JSON is at ``path``; None as for ``read_animation``.

    Frames that have durations are shown at a constant rate (``timing.time_drawings``), others one
    after the other at ``fps``.

    Raises:
        SourceError: The JSON or an image is unreadable or malformed, a frame lies outside of its
            page, the frames differ in size, or some have a duration and others none.
    """
    chosen = read_animation(path, animation)
    frames = chosen.frames
    size = _shared_size(path, frames)
    check_size(f"{path}: frame '{frames[0].name}'", *size, max_pixels)
    timing = _timing(path, frames, fps, chosen.fps)
    pages = dict.fromkeys(frame.page for frame in frames)
    headers = {page: read_header(page.image, max_pixels) for page in pages}
    stored = sorted(dict.fromkeys(frames), key=lambda frame: list(pages).index(frame.page))
    for frame in stored:
        _check_place(path, frame, headers[frame.page])
    number = {frame: i for i, frame in enumerate(stored)}
    parts = SequentialDecoder(path, partial(_cut, stored, headers))

    def read(i: int) -> Picture:
        frame = frames[timing.shown[i]]
        return _untrimmed(frame, parts.read(number[frame]))

    return FrameReader(
        width=size[0],
        height=size[1],
        fps=timing.rate or None,
        count=len(timing.shown),
        read=read,
        inputs=chosen.files,
        notes=(
            *shared_notes({page.image: header for page, header in headers.items()}),
            *chosen.notes,
            *(
                _size_note(page, header)
                for page, header in headers.items()
                if _differs(page, header)
            ),
            *timing.notes,
        ),
    )


def _shared_size(path: Path, frames: Sequence[AtlasFrame]) -> tuple[int, int]:
    """Return the (width, height) of all whole frames, px; refuse frames that differ."""
    first = frames[0]
    for frame in frames:
        if (frame.full_width, frame.full_height) != (first.full_width, first.full_height):
            raise SourceError(
                f"{path}: frame '{frame.name}' is {frame.full_width}x{frame.full_height} "
                f"(sourceSize), but '{first.name}' is {first.full_width}x{first.full_height}; all "
                f"frames of an animation must have one size"
            )
    return first.full_width, first.full_height


def _timing(
    path: Path, frames: Sequence[AtlasFrame], fps: float | None, atlas_fps: float | None
) -> Timing:
    """Return which frame is shown at each tick; a rate of 0 if neither JSON nor user state one."""
    delays = [frame.duration for frame in frames if frame.duration is not None]
    if len(frames) > 1 and len(delays) == len(frames):
        return time_drawings(delays, fps, path, atlas_fps)
    if delays and len(delays) < len(frames):
        timeless = next(frame for frame in frames if frame.duration is None)
        raise SourceError(
            f"{path}: frame '{timeless.name}' has no duration, but others of its animation have "
            f"one; give all of them one, or none and source.fps"
        )
    return Timing(fps or atlas_fps or 0, tuple(range(len(frames))))


def _check_place(path: Path, frame: AtlasFrame, page: Header) -> None:
    width, height = _stored_size(frame)
    if frame.x + width > page.width or frame.y + height > page.height:
        raise SourceError(
            f"{path}: frame '{frame.name}' is {width}x{height} px at ({frame.x}, {frame.y}), "
            f"outside of {frame.page.image.name}, which is {page.width}x{page.height}; export both "
            f"again"
        )


def _stored_size(frame: AtlasFrame) -> tuple[int, int]:
    """Return the width and height of a frame on its page, px."""
    size = frame.width, frame.height
    return size[::-1] if frame.rotated else size


def _differs(page: AtlasPage, header: Header) -> bool:
    return page.size is not None and page.size != (header.width, header.height)


def _size_note(page: AtlasPage, header: Header) -> str:
    width, height = page.size or (0, 0)
    return (
        f"{page.image.name} is {header.width}x{header.height} px, but its JSON says "
        f"{width}x{height}: if it was scaled, frames are cut in wrong places"
    )


def _cut(frames: Sequence[AtlasFrame], headers: dict[AtlasPage, Header]) -> Generator[Picture]:
    """Yield the upright stored part of each frame; ``frames`` are sorted by their pages."""
    page: AtlasPage | None = None
    picture: Picture = np.empty((0, 0, 4), np.uint8)
    for frame in frames:
        if frame.page != page:
            page = frame.page
            picture = decode(page.image, headers[page])
        width, height = _stored_size(frame)
        part = picture[frame.y : frame.y + height, frame.x : frame.x + width]
        upright = np.rot90(part) if frame.rotated else part
        is_multiplied = page.alpha == "premultiplied" and picture.dtype.kind == "u"
        yield _light_of(upright, page.blend_space) if is_multiplied else upright


def _light_of(stored: Picture, blend_space: str) -> Picture:
    """Return the light (H, W, 4) of integer pixels whose colours were multiplied by their coverage
    as encoded in ``blend_space``. Light that is brighter than its coverage, by more than what is
    rounded, gets what it needs."""
    if stored.shape[2] < 4:
        return stored
    unit = stored.astype(np.float32) / np.float32(white(stored.dtype))
    if blend_space == "linear":
        unit[..., :3] = srgb_to_linear(unit[..., :3])
    needed, step = brightest(unit), np.float32(1 / white(stored.dtype))
    unit[..., 3] = np.where(needed > unit[..., 3] + 2 * step, needed, unit[..., 3])
    if blend_space != "linear":
        coverage, none = unit[..., 3:], np.zeros_like(unit[..., :3])
        colour = np.divide(unit[..., :3], coverage, out=none, where=coverage > 0)
        unit[..., :3] = srgb_to_linear(np.minimum(colour, 1)) * coverage
    return unit


def _untrimmed(frame: AtlasFrame, part: Picture) -> Picture:
    """Return the whole frame: transparent around its stored part, black if pages have no alpha."""
    if part.shape[:2] == (frame.full_height, frame.full_width):
        return part
    whole = np.zeros((frame.full_height, frame.full_width, part.shape[2]), part.dtype)
    rows = slice(frame.trim_y, frame.trim_y + frame.height)
    whole[rows, frame.trim_x : frame.trim_x + frame.width] = part
    return whole
