"""Pack all frames onto pages, and draw the images of pages and maps one by one."""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.gpu import with_textures
from fire_atlas.atlas.mesh import with_meshes
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AtlasSheet, GpuTexture, Sprite
from fire_atlas.core.context import BuildContext
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import Role
from fire_atlas.maps.kinds import MapKind, kinds_in
from fire_atlas.maps.layer import draw_sprites
from fire_atlas.maps.maker import maker_of, with_maps
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.pages.content import PageContent
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import Atlas, Maps, export_name

_PHONE_SIDE = 4096
"""Largest side of a texture, px, that nearly all phones load."""

_STRAIGHT_ALONE: set[str] = {"aseprite", "css", "phaser"}
"""Exports whose clients blend no premultiplied pages."""


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


def pack(
    loaded: LoadedRecipe, content: PageContent, context: BuildContext
) -> tuple[AtlasSheet, ...]:
    """Pack the frames of all animations onto the pages of each scale, and their maps; find the
    meshes of frames.

    Args:
        loaded: The recipe.
        content: The animations and the textures of flakes.
        context: Receives a note if one page is not enough, for all or for one of the animations.

    Raises:
        OutputError: A frame is too large for a page, or there are more pages than
            ``atlas.max_pages``.
    """
    recipe, animations, textures = loaded.recipe, content.animations, content.textures
    atlas, maps, mapped = recipe.atlas, recipe.maps, list(animations.values())
    sheets = placed(recipe, content)
    _refuse_split(sheets[0], textures)
    if len(sheets[0].pages) > 1:
        from fire_atlas.pipeline.pages.page_count import check_page_count

        check_page_count(sheets[0], loaded, animations, context)
    largest = max(sheets[0].pages, key=lambda page: max(page.width, page.height))
    if max(largest.width, largest.height) > _PHONE_SIDE:
        context.progress.note(
            f"{largest.width}x{largest.height} px are more than many phones load, "
            f"{_PHONE_SIDE} px a side: atlas.max_size: {_PHONE_SIDE} keeps to that"
        )
    if _darkens_by_day(recipe, mapped):
        context.progress.note(
            "atlas.alpha: straight, the default, hides what is behind thin fire, so that it "
            "darkens a bright background; premultiplied adds its light, in clients that blend it "
            "so (PixiJS, three.js, Godot, Unity)"
        )
    if atlas.grid is not None:
        from fire_atlas.pipeline.pages.page_count import note_empty_cells

        note_empty_cells(sheets[0], (atlas.grid.columns, atlas.grid.rows), context)
    around = max(_margin_of_maps(maps, mapped), trim_margin(atlas, has_hard_edges=True))
    sheets = _with_meshes(sheets, content, around, atlas, context)
    sheets = tuple(with_maps(content.described(sheet), mapped, maps) for sheet in sheets)
    return tuple(with_textures(sheet, atlas) for sheet in sheets)


def placed(recipe: Recipe, content: PageContent) -> tuple[AtlasSheet, ...]:
    """Return where all frames lie on the pages of each scale, without maps, meshes and textures.

    Raises:
        OutputError: A frame is too large for a page.
    """
    atlas, animations = recipe.atlas, content.animations
    around = _margin_of_maps(recipe.maps, list(animations.values()))
    singles = [
        sprite.for_pages(max(around, trim_margin(atlas, has_hard_edges=True)))
        for sprite in content.single
    ]
    packed = [
        animation.frames_for_pages(title, max(around, trim_margin(atlas, animation.has_hard_edges)))
        for title, animation in animations.items()
    ]
    cells = [
        texture.frames_for_pages(title, packed[0].duration)
        for title, texture in content.textures.items()
    ]
    return build_sheets(
        recipe.name, packed, atlas,
        singles=singles, textures=cells, shares=recipe.maps == Maps(),
    )  # fmt: skip


def _margin_of_maps(maps: Maps, animations: Sequence[FinishedAnimation]) -> int:
    """Return how many px around all frames the maps need."""
    return max((_margin(kind, animations) for kind in kinds_in(maps)), default=0)


def _darkens_by_day(recipe: Recipe, animations: Sequence[FinishedAnimation]) -> bool:
    """Return whether pages are straight by default alone, and show light that premultiplied ones
    would add, as the recipe's clients can."""
    is_chosen = recipe.atlas.alpha != "straight" or "alpha" in recipe.atlas.model_fields_set
    if is_chosen or _STRAIGHT_ALONE & {export_name(export) for export in recipe.exports}:
        return False
    return any(
        not animation.has_hard_edges and animation.statistics.get("matte", "none") != "none"
        for animation in animations
    )


def _margin(kind: MapKind, animations: Sequence[FinishedAnimation]) -> int:
    """Return how many px around all frames a map needs."""
    return maker_of(kind).margin([animation.maps[kind.name] for animation in animations])


def trim_margin(atlas: Atlas, has_hard_edges: bool) -> int:
    """Return how many empty px trimming keeps around frames."""
    if atlas.trim_margin != "auto":
        return atlas.trim_margin
    return 1 if has_hard_edges or atlas.mesh != "none" else 0


def _with_meshes(
    sheets: Sequence[AtlasSheet],
    content: PageContent,
    margin: int,
    atlas: Atlas,
    context: BuildContext,
) -> tuple[AtlasSheet, ...]:
    """Return the sheets of all scales with a mesh for each frame, if the recipe asks for them.

    Args:
        sheets: The sheets, the largest first.
        content: What they show: pages and layers share their meshes.
        margin: Empty px that are kept around what is visible, at full size.
        atlas: Settings of the pages.
        context: Its progress advances with each frame of each scale.
    """
    if atlas.mesh == "none":
        return tuple(sheets)
    frames = content.frames()
    context.progress.stage("mesh", len(sheets) * len(frames))
    return tuple(
        with_meshes(
            sheet,
            [[f.sprites[scale], *(layer[scale] for layer in f.layers())] for f in frames],
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
                "its cells do not fit one page; use fewer, a smaller flakes.size, or a larger "
                "atlas.max_size",
                key=("flakes", "texture"),
            )


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
    cells = [cell for texture in content.textures.values() for cell in texture.sprites]
    frames, kinds, mapped = content.frames(), kinds_in(maps), list(content.animations.values())
    for scale, sheet in enumerate(sheets):
        edges = Edges.of(atlas, sheet.scale)
        files = [page.file for page in sheet.pages]
        shown = [variants[scale] for variants in (*(frame.sprites for frame in frames), *cells)]
        if content.heat is None:
            for page, file in enumerate(files):
                draw = partial(draw_sprites, sheet, page, shown, edges, context.workers)
                yield _image(sheet, file, "page", draw)
        else:
            yield from _heat_pages(sheet, shown, edges, context)
        for kind in kinds:
            yield from _map_images(kind, sheet, mapped, scale, edges, context)
    if content.heat is not None and sheets[0].heat is not None:
        ramps = content.heat.ramps
        yield Image(sheets[0].heat.ramp, "ramp", lambda: ramps, is_data=True)


def _map_images(
    kind: MapKind,
    sheet: AtlasSheet,
    animations: Sequence[FinishedAnimation],
    scale: int,
    edges: Edges,
    context: BuildContext,
) -> Iterator[Image]:
    """Yield the images of a map beside each page of a sheet."""
    content = maker_of(kind).content(kind, animations, scale)
    for page, file in enumerate(sheet.map(kind.name).files):
        draw = partial(maker_of(kind).draw, kind, sheet, page, content, edges, context.workers)
        yield _image(sheet, file, "map", draw, is_data=kind.holds == "data")


def _heat_pages(
    sheet: AtlasSheet, sprites: Sequence[Sprite], edges: Edges, context: BuildContext
) -> Iterator[Image]:
    """Yield pages of heat: of one channel, (H, W), if that has it all."""
    for i, page in enumerate(sheet.pages):
        draw = partial(draw_page, sheet, i, sprites, edges, np.uint8, context.workers)
        if sheet.heat is not None and sheet.heat.pixels == "heat":
            draw = partial(_first_channel, draw)
        yield _image(sheet, page.file, "page", draw, is_data=True)


def _first_channel(draw: Callable[[], NDArray[Any]]) -> NDArray[Any]:
    return draw()[..., 0]


def _image(
    sheet: AtlasSheet,
    file: str,
    role: Role,
    draw: Callable[[], NDArray[Any]],
    *,
    is_data: bool = False,
) -> Image:
    """Return an image of a sheet, with the textures that show it."""
    textures, found = sheet.textures_of(file), sheet.map_of(file)
    has_cover = found is not None and found.is_under
    return Image(file, role, draw, is_data, sheet.channels_of(file), textures, has_cover)
