"""Pack all frames onto pages, and draw the images of pages and maps one by one."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.mesh import with_meshes
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AtlasSheet, Sprite
from fire_atlas.atlas.split import max_size_for, split_animations
from fire_atlas.channels.encoding import motion_encoding
from fire_atlas.channels.page import draw_motion_page, vector_margin, with_maps
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import Role
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.progress import Progress
from fire_atlas.pipeline.contribution import FinishedAnimation
from fire_atlas.pipeline.flake_texture import PreparedTexture
from fire_atlas.recipe.output import Atlas, Maps


class Image(NamedTuple):
    """An image to be written."""

    name: str
    role: Role
    draw: Callable[[], Bytes]
    """Draws it: (H, W, 4) uint8."""
    is_data: bool = False
    """It holds vectors, not colours: it is written without loss."""


_MAX_NAMES = 12
"""Maximum number of animations that a note names."""


def pack(
    name: str,
    animations: Mapping[str, FinishedAnimation],
    textures: Mapping[str, PreparedTexture],
    atlas: Atlas,
    maps: Maps,
    progress: Progress,
) -> tuple[AtlasSheet, ...]:
    """Pack the frames of all animations onto the pages of each scale, and their maps; find the
    meshes of frames.

    Args:
        name: File stem of the outputs.
        animations: By their names on the pages.
        textures: Textures of flakes, by their names on the pages.
        atlas: Settings of the pages.
        maps: Settings of the maps beside them.
        progress: Receives a note if one page is not enough, for all or for one of the animations.
    """
    motions = [each.motion for each in animations.values() if each.motion is not None]
    packed = [animation.frames_for_pages(title) for title, animation in animations.items()]
    cells = [each.frames_for_pages(title, packed[0].duration) for title, each in textures.items()]
    sheets = build_sheets(
        name, packed, atlas,
        textures=cells, margin=vector_margin(motions), shares=maps == Maps(),
    )  # fmt: skip
    _refuse_split(sheets[0], textures)
    if len(sheets[0].pages) > 1:
        progress.note(
            f"needs {len(sheets[0].pages)} pages; a larger atlas.max_size, a smaller source.height "
            f"or fewer frames could make one page enough"
        )
        _note_split(sheets[0], atlas, progress)
    sheets = _with_meshes(sheets, animations, vector_margin(motions), atlas, progress)
    encoding = None if maps.motion == "none" else motion_encoding(maps.motion)
    return tuple(with_maps(sheet, maps.layers, motions, encoding) for sheet in sheets)


def _with_meshes(
    sheets: Sequence[AtlasSheet],
    animations: Mapping[str, FinishedAnimation],
    margin: int,
    atlas: Atlas,
    progress: Progress,
) -> tuple[AtlasSheet, ...]:
    """Return the sheets of all scales with a mesh for each frame, if the recipe asks for them.

    Args:
        sheets: The sheets, the largest first.
        animations: What they show: pages and layers share their meshes.
        margin: Empty px that are kept around what is visible, at full size.
        atlas: Settings of the pages.
        progress: Advances with each frame of each scale.
    """
    if atlas.mesh == "none":
        return tuple(sheets)
    frames = [frame for animation in animations.values() for frame in animation.frames]
    progress.stage("mesh", len(sheets) * len(frames))
    return tuple(
        with_meshes(
            sheet,
            [[f.sprites[scale], *(each[scale] for each in f.layers.values())] for f in frames],
            atlas.mesh.vertices,
            threshold=atlas.trim_threshold,
            margin=math.ceil(margin * sheet.scale),
            done=progress.advance,
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


def _note_split(sheet: AtlasSheet, atlas: Atlas, progress: Progress) -> None:
    """Name the animations that no page can hold, and the page size that could."""
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
    progress.note(f"no page can hold all frames of {names}{more}: {advice}")


def images(
    sheets: Sequence[AtlasSheet],
    animations: Mapping[str, FinishedAnimation],
    textures: Mapping[str, PreparedTexture],
    atlas: Atlas,
    maps: Maps,
) -> Iterator[Image]:
    """Yield the images of all sheets, one for each scale: its pages, then its maps.

    ``animations`` and ``textures`` are in the order in which they were packed. Maps do not show
    textures.
    """
    cells = [cell for texture in textures.values() for cell in texture.sprites]
    frames = [frame for animation in animations.values() for frame in animation.frames]
    motions = [each.motion for each in animations.values() if each.motion is not None]
    for scale, sheet in enumerate(sheets):
        edges = Edges.of(atlas, sheet.scale)
        files = [page.file for page in sheet.pages]
        shown = [each[scale] for each in (*(frame.sprites for frame in frames), *cells)]
        yield from _sprite_pages(sheet, files, "page", shown, edges)
        for layer in maps.layers:
            sprites = [frame.layers[layer][scale] for frame in frames]
            yield from _sprite_pages(sheet, sheet.map(layer).files, "map", sprites, edges)
        if maps.motion != "none":
            vectors = [each for motion in motions for each in motion.frames()]
            encoding = motion_encoding(maps.motion)
            for i, file in enumerate(sheet.map("motion").files):
                draw = partial(draw_motion_page, sheet, i, vectors, encoding, edges)
                yield Image(file, "map", draw, is_data=True)


def _sprite_pages(
    sheet: AtlasSheet, files: Sequence[str], role: Role, sprites: Sequence[Sprite], edges: Edges
) -> Iterator[Image]:
    """Yield the images that show ``sprites`` where the sheet has its frames and cells."""
    for i, file in enumerate(files):
        yield Image(file, role, partial(draw_page, sheet, i, sprites, edges))
