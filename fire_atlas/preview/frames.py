"""Cut the frames of a finished atlas out of its pages."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from fire_atlas.atlas.encode import light_over_black
from fire_atlas.atlas.sheet import Region, common_canvas
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.effect.flakes.texture import TextureCells
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.pages.page_file import read_page


def cut_frames(atlas: AtlasFile) -> Iterator[Bytes]:
    """Yield every frame at its full size, (H, W, 4) uint8 RGBA as stored, in playing order.

    Raises:
        SourceError: A page file is missing, or is not as the atlas states.
    """
    return _cut_out(atlas, atlas.frames)


def cells_named(names: Sequence[str], cells: Sequence[Region]) -> list[Region]:
    """Return the cells of a texture by their names in the tracks.

    Raises:
        SourceError: There is none of a name: the tracks are of another build than the atlas.
    """
    known = {cell.name: cell for cell in cells}
    if missing := [name for name in names if name not in known]:
        raise SourceError(f"the atlas has no {missing[0]}, which its tracks name; build it again")
    return [known[name] for name in names]


def texture_of(atlas: AtlasFile, tracks: Tracks) -> TextureCells | None:
    """Return what the flakes of some tracks are drawn with, as the pages show it; None without.

    Raises:
        SourceError: A page file is missing, or the atlas lacks a cell.
    """
    if tracks.texture is None:
        return None
    cells, sheet = cells_named(tracks.texture.frames, atlas.sheet.cells), atlas.sheet
    light = np.stack([
        light_over_black(cell, sheet.alpha, sheet.blend_space)
        for cell in _cut_out(atlas, cells)
    ])  # fmt: skip
    mask = light.max(axis=3, keepdims=True)
    return TextureCells(mask if tracks.texture.tinted else light, over_life=False)


def _cut_out(atlas: AtlasFile, regions: Iterable[Region]) -> Iterator[Bytes]:
    pages: dict[int, Bytes] = {}
    for frame in regions:
        if frame.page not in pages:
            page = atlas.sheet.pages[frame.page]
            path = atlas.path.with_name(page.file)
            pages = {frame.page: read_page(path, page.width, page.height)}
        cut = _cut(pages[frame.page], frame)
        if cut is None:
            raise SourceError(
                f"{atlas.path}: {frame.name} lies outside of its page or of its own frame"
            )
        yield cut


def aligned_frames(atlas: AtlasFile) -> Iterator[Bytes]:
    """Yield every frame on a canvas large enough for all of them, aligned at their pivots."""
    (width, height), places = common_canvas(atlas.frames)
    for frame, (x, y) in zip(cut_frames(atlas), places, strict=True):
        canvas = np.zeros((height, width, 4), np.uint8)
        canvas[y : y + frame.shape[0], x : x + frame.shape[1]] = frame
        yield canvas


def _cut(page: Bytes, frame: Region) -> Bytes | None:
    """Return an untrimmed frame; None if it lies outside of its page or of its own size."""
    full = np.zeros((frame.frame_height, frame.frame_width, 4), np.uint8)
    cell = _window(page, frame.x, frame.y, *frame.page_size)
    if frame.rotated:
        cell = np.rot90(cell)
    target = _window(full, frame.trim_x, frame.trim_y, frame.width, frame.height)
    if cell.shape != target.shape or cell.shape[:2] != (frame.height, frame.width):
        return None
    target[:] = cell
    return full


def _window(image: Bytes, x: int, y: int, width: int, height: int) -> Bytes:
    """Return the part of ``image`` at (x, y); empty if x or y is negative."""
    return image[y : y + height, x : x + width] if min(x, y) >= 0 else image[:0, :0]
