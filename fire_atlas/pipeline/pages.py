"""Pack all frames onto pages, and draw the images of pages and maps one by one."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.gpu import with_textures
from fire_atlas.atlas.mesh import with_meshes
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AtlasSheet, GpuTexture, PlacedImage, Sprite
from fire_atlas.channels.form import deepest, draw_form_page
from fire_atlas.channels.page import (
    draw_vector_page,
    vector_margin,
    with_form_maps,
    with_maps,
)
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import Role
from fire_atlas.pipeline.content import PageContent
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.contribution import FinishedAnimation
from fire_atlas.recipe.output import Atlas, Maps

if TYPE_CHECKING:
    from fire_atlas.channels.haze import Haze
    from fire_atlas.channels.motion import Motion


class Image(NamedTuple):
    """An image to be written."""

    name: str
    role: Role
    draw: Callable[[], NDArray[Any]]
    """Draws it: (H, W, 4), uint8, uint16 or, of light, float16; of heat (H, W) uint8."""
    is_data: bool = False
    """It holds vectors or light, not colours: it is written without loss."""
    channels: int = 4
    """Number of channels that clients read."""
    textures: tuple[GpuTexture, ...] = ()
    """The compressed textures of it that are to be written."""
    has_cover: bool = False
    """It hides what is behind it even where pages only add light."""


_DTYPES: dict[int, DTypeLike] = {8: np.uint8, 16: np.uint16}
"""Types of pages by their bits a channel."""

_MAX_NAMES = 12
"""Maximum number of animations that a note names."""


def pack(
    name: str,
    content: PageContent,
    atlas: Atlas,
    maps: Maps,
    context: BuildContext,
) -> tuple[AtlasSheet, ...]:
    """Pack the frames of all animations onto the pages of each scale, and their maps; find the
    meshes of frames.

    Args:
        name: File stem of the outputs.
        content: The animations and the textures of flakes.
        atlas: Settings of the pages.
        maps: Settings of the maps beside them.
        context: Receives a note if one page is not enough, for all or for one of the animations.
    """
    animations, textures = content.animations, content.textures
    motions = [each.motion for each in animations.values() if each.motion is not None]
    packed = [animation.frames_for_pages(title) for title, animation in animations.items()]
    cells = [each.frames_for_pages(title, packed[0].duration) for title, each in textures.items()]
    sheets = build_sheets(
        name, packed, atlas,
        textures=cells, margin=vector_margin(motions), shares=maps == Maps(),
    )  # fmt: skip
    _refuse_split(sheets[0], textures)
    if len(sheets[0].pages) > 1:
        context.progress.note(
            f"needs {len(sheets[0].pages)} pages; a larger atlas.max_size, a smaller source.height "
            f"or fewer frames could make one page enough"
        )
        _note_split(sheets[0], atlas, context)
    sheets = _with_meshes(sheets, animations, vector_margin(motions), atlas, context)
    hazes, has_emission = _hazes(animations), maps.emission == "exr"
    sheets = tuple(
        with_maps(
            content.described(sheet),
            maps.layers,
            motions,
            maps.motion,
            hazes,
            has_emission=has_emission,
        )
        for sheet in sheets
    )
    if maps.form:
        reach = deepest(frame.form[0] for each in animations.values() for frame in each.frames)
        sheets = tuple(with_form_maps(sheet, maps.form, reach) for sheet in sheets)
    return tuple(with_textures(sheet, atlas) for sheet in sheets)


def _hazes(animations: Mapping[str, FinishedAnimation]) -> "list[Haze]":
    """Return the haze of each animation that has it: all, or none."""
    return [each.haze for each in animations.values() if each.haze is not None]


def _with_meshes(
    sheets: Sequence[AtlasSheet],
    animations: Mapping[str, FinishedAnimation],
    margin: int,
    atlas: Atlas,
    context: BuildContext,
) -> tuple[AtlasSheet, ...]:
    """Return the sheets of all scales with a mesh for each frame, if the recipe asks for them.

    Args:
        sheets: The sheets, the largest first.
        animations: What they show: pages and layers share their meshes.
        margin: Empty px that are kept around what is visible, at full size.
        atlas: Settings of the pages.
        context: Its progress advances with each frame of each scale.
    """
    if atlas.mesh == "none":
        return tuple(sheets)
    frames = [frame for animation in animations.values() for frame in animation.frames]
    context.progress.stage("mesh", len(sheets) * len(frames))
    return tuple(
        with_meshes(
            sheet,
            [[f.sprites[scale], *(each[scale] for each in f.layers.values())] for f in frames],
            atlas.mesh.vertices,
            threshold=atlas.trim_threshold,
            margin=math.ceil(margin * sheet.scale),
            done=context.progress.advance,
        )
        for scale, sheet in enumerate(sheets)
    )


def _refuse_split(sheet: AtlasSheet, textures: Collection[str]) -> None:
    """Refuse a texture whose cells are on several pages: players draw flakes with one."""
    for title in textures:
        prefix = f"{sheet.title}/{title}/"
        if len({cell.page for cell in sheet.cells if cell.name.startswith(prefix)}) > 1:
            raise OutputError(
                "flakes.texture: its cells do not fit one page; use fewer, a smaller flakes.size, "
                "or a larger atlas.max_size"
            )


def _note_split(sheet: AtlasSheet, atlas: Atlas, context: BuildContext) -> None:
    """Name the animations that no page can hold, and the page size that could."""
    from fire_atlas.atlas.split import max_size_for, split_animations

    split = split_animations(sheet)
    if not split:
        return
    names = ", ".join(each.name for each in split[:_MAX_NAMES])
    more = f" and {len(split) - _MAX_NAMES} more" if len(split) > _MAX_NAMES else ""
    size = max_size_for(split, sheet, atlas)
    advice = (
        f"with atlas.max_size: {size} one could"
        if size
        else "none that a recipe may ask for could; smaller or fewer frames help"
    )
    context.progress.note(f"no page can hold all frames of {names}{more}: {advice}")


def images(
    sheets: Sequence[AtlasSheet],
    content: PageContent,
    atlas: Atlas,
    maps: Maps,
    context: BuildContext,
) -> Iterator[Image]:
    """Yield the images of all sheets, one for each scale: its pages, then its maps; then ramps.

    ``content`` is in the order in which it was packed. Maps do not show textures.
    """
    animations, textures = content.animations, content.textures
    cells = [cell for texture in textures.values() for cell in texture.sprites]
    frames = [frame for animation in animations.values() for frame in animation.frames]
    motions = [each.motion for each in animations.values() if each.motion is not None]
    for scale, sheet in enumerate(sheets):
        edges = Edges.of(atlas, sheet.scale)
        files = [page.file for page in sheet.pages]
        shown = [each[scale] for each in (*(frame.sprites for frame in frames), *cells)]
        if content.heat is None:
            yield from _sprite_pages(sheet, files, "page", shown, edges, context)
        else:
            yield from _heat_pages(sheet, shown, edges)
        for layer in maps.layers:
            sprites = [frame.layers[layer][scale] for frame in frames]
            yield from _sprite_pages(sheet, sheet.map(layer).files, "map", sprites, edges, context)
        if maps.emission == "exr":
            light = [frame.emission[scale] for frame in frames]
            yield from _light_pages(sheet, light, edges)
        form = [frame.form[scale] for frame in frames] if maps.form else []
        for kind in maps.form:
            for i, file in enumerate(sheet.map(kind).files):
                draw_form = partial(draw_form_page, sheet, i, form, edges, kind)
                yield _image(sheet, file, "map", draw_form, is_data=True)
        if maps.motion != "none":
            yield from _vector_pages(sheet, "motion", motions, edges)
        if maps.haze:
            yield from _vector_pages(sheet, "haze", _hazes(animations), edges)
    if content.heat is not None:
        ramps = content.heat.ramps
        yield Image(content.heat.description.ramp, "ramp", lambda: ramps, is_data=True)


def _vector_pages(
    sheet: AtlasSheet, kind: str, vectors: "Sequence[Motion | Haze]", edges: Edges
) -> Iterator[Image]:
    """Yield the images with the vectors of each animation."""
    frames = [frame for each in vectors for frame in each.frames()]
    for i, file in enumerate(sheet.map(kind).files):
        draw = partial(draw_vector_page, sheet, i, kind, frames, edges)
        yield _image(sheet, file, "map", draw, is_data=True)


def _heat_pages(sheet: AtlasSheet, sprites: Sequence[Sprite], edges: Edges) -> Iterator[Image]:
    """Yield pages of heat: of one channel, (H, W), if that has it all."""
    for i, page in enumerate(sheet.pages):
        draw = partial(draw_page, sheet, i, sprites, edges, np.uint8)
        if sheet.heat is not None and sheet.heat.pixels == "heat":
            draw = partial(_first_channel, draw)
        yield _image(sheet, page.file, "page", draw, is_data=True)


def _first_channel(draw: Callable[[], NDArray[Any]]) -> NDArray[Any]:
    return draw()[..., 0]


def _sprite_pages(
    sheet: AtlasSheet,
    files: Sequence[str],
    role: Role,
    sprites: Sequence[Sprite],
    edges: Edges,
    context: BuildContext,
) -> Iterator[Image]:
    """Yield the images that show ``sprites`` where the sheet has its frames and cells."""
    shown, dtype = [each.in_bits(sheet.bits) for each in sprites], _DTYPES[sheet.bits]
    for i, file in enumerate(files):
        draw = partial(draw_page, sheet, i, shown, edges, dtype, context.workers)
        yield _image(sheet, file, role, draw)


def _light_pages(sheet: AtlasSheet, light: Sequence[PlacedImage], edges: Edges) -> Iterator[Image]:
    """Yield the images with the light of the frames before exposure."""
    # Premultiplied, so that filters need no colour beyond the edge.
    unbled = replace(edges, bleed=0)
    for i, file in enumerate(sheet.map("emission").files):
        draw = partial(draw_page, sheet, i, light, unbled, np.float16)
        yield _image(sheet, file, "map", draw, is_data=True)


def _image(
    sheet: AtlasSheet,
    file: str,
    role: Role,
    draw: Callable[[], NDArray[Any]],
    *,
    is_data: bool = False,
) -> Image:
    """Return an image of a sheet, with the textures that show it."""
    textures, has_cover = sheet.textures_of(file), sheet.kind_of(file) == "smoke"
    return Image(file, role, draw, is_data, sheet.channels_of(file), textures, has_cover)
