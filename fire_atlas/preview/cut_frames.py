"""Cut the frames of a finished atlas out of its pages."""

import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from PIL import Image

from fire_atlas.atlas.encode import light_over_black, over_smoke
from fire_atlas.atlas.sheet import CHANNELS, RAMP_WIDTH, AtlasSheet, Region, common_canvas
from fire_atlas.core.errors import SourceError
from fire_atlas.core.pixels import Bytes
from fire_atlas.effect.flakes.texture import TextureCells
from fire_atlas.effect.flakes.tracks import Tracks
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.pages.page_file import read_page, read_page_file


def shown_page(atlas: AtlasFile, index: int) -> Bytes:
    """Return a page, (H, W, 4) uint8 as stored, with its smoke under the fire, if there is any.

    Raises:
        SourceError: A file is missing, or is not as the atlas states.
    """
    sheet = atlas.sheet
    page = sheet.pages[index]
    files = [
        page.file,
        *(sheet_map.files[index] for sheet_map in sheet.maps if sheet_map.kind == "smoke"),
    ]
    fire, *smoke = (read_page(atlas.path.parent / f, page.width, page.height) for f in files)
    return over_smoke(fire, smoke[0], sheet.alpha, sheet.blend_space) if smoke else fire


def shown_alpha(sheet: AtlasSheet) -> str:
    """Return how a client blends what ``shown_page`` returns: smoke under fire that is added has
    coverage."""
    has_smoke = any(sheet_map.kind == "smoke" for sheet_map in sheet.maps)
    return "premultiplied" if has_smoke and sheet.alpha == "additive" else sheet.alpha


def cut_frames(atlas: AtlasFile) -> Iterator[Bytes]:
    """Yield every frame at its full size, (H, W, 4) uint8 RGBA as stored, in playing order, with
    its smoke under the fire; heat with the colours of the first ramp.

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
    ramp = first_ramp(atlas)
    for frame in regions:
        if frame.page not in pages:
            pages = {frame.page: shown_page(atlas, frame.page)}
        cut = _cut(pages[frame.page], frame)
        if cut is None:
            raise SourceError(
                f"{atlas.path}: {frame.name} lies outside of its page or of its own frame"
            )
        yield cut if ramp is None else coloured(cut, frame, ramp)


def first_ramp(atlas: AtlasFile) -> Bytes | None:
    """Return the colours by heat, (256, 4), of the first ramp; None if pages have colours.

    Raises:
        SourceError: Its file is missing, or is not as the atlas states.
    """
    heat = atlas.sheet.heat
    if heat is None:
        return None
    ramps = read_page(atlas.path.parent / heat.ramp, RAMP_WIDTH, len(heat.rows))
    return np.asarray(ramps[0])


def colour_pages(atlas: AtlasFile) -> tuple[AtlasFile, list[bytes]]:
    """Return an atlas as if it had pages of colours, and the files of these.

    A page of heat gets the colours of the first ramp; one of ``heat4`` is four, a channel each.

    Raises:
        SourceError: A page file is missing, or is not as the atlas states.
    """
    sheet, ramp = atlas.sheet, first_ramp(atlas)
    pages = [(atlas.path.parent / page.file, page.width, page.height) for page in sheet.pages]
    if sheet.heat is None or ramp is None:
        return atlas, [read_page_file(*page) for page in pages]
    used = CHANNELS if sheet.heat.pixels == "heat4" else "r"
    heats = (read_page(*page)[..., CHANNELS.index(channel)] for page in pages for channel in used)
    return replace(atlas, sheet=_in_colours(sheet, used)), [_png(ramp[heat]) for heat in heats]


def _in_colours(sheet: AtlasSheet, used: str) -> AtlasSheet:
    """Return a sheet of heat as one whose pages are those of the ``used`` channels, in colours."""
    pages = tuple(page for page in sheet.pages for _ in used)
    regions = tuple(
        replace(region, page=region.page * len(used) + used.index(region.channel or "r"))
        for region in sheet.regions
    )
    return replace(sheet, pages=pages, regions=regions, heat=None, image_format="png")


def _png(image: Bytes) -> bytes:
    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG", compress_level=1)
    return file.getvalue()


def coloured(heat: Bytes, frame: Region, ramp: Bytes) -> Bytes:
    """Return the colours (H, W, 4) of a frame's heat, which is in one channel of (H, W, 4)."""
    return np.asarray(ramp[heat[..., CHANNELS.index(frame.channel or "r")]])


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
