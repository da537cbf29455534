"""Read the texture of flakes: one image, or the cells of a sheet."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture, has_transparency, to_light
from fire_atlas.core.pixels import Pixels
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.recipe.effect import MAX_TEXTURE_CELLS, FlakeTexture
from fire_atlas.sources.images import decode, detect_format, read_header
from fire_atlas.sources.matte import luminance_of_light
from fire_atlas.sources.sheet import open_sheet

_VISIBLE = 1 / 255
"""Coverage from which a pixel shows something."""


def read_cells(
    settings: FlakeTexture, path: Path, blend_space: str, max_pixels: int = MAX_PIXELS
) -> list[Pixels]:
    """Return the cells of a texture, (h, w, 4) each.

    Without any transparency, what is black in it is empty: its coverage is its luminance.

    Args:
        settings: The recipe's section.
        path: The image.
        blend_space: Where the client blends, for the luminance matte.
        max_pixels: Limit on the pixels of a picture.

    Raises:
        SourceError: It is not an image, broken, too large, too small for its grid, or empty.
    """
    pictures = [read() for read in examine_cells(settings, path, max_pixels)]
    keyed = not any(map(has_transparency, pictures))
    cells = [
        luminance_of_light(to_light(picture), blend_space) if keyed else to_light(picture)
        for picture in pictures
    ]
    if not any((cell[..., 3] > _VISIBLE).any() for cell in cells):
        raise SourceError(
            f"{path}: shows nothing: every pixel is {'black' if keyed else 'transparent'}; "
            f"paint the flake in light colours"
        )
    return cells


def examine_cells(
    settings: FlakeTexture, path: Path, max_pixels: int = MAX_PIXELS
) -> list[Callable[[], Picture]]:
    """Return a reader of each cell of the texture at ``path``, none of which is decoded yet.

    Raises:
        SourceError: It is not an image, too large, too small for its grid, or has too many cells.
    """
    if not path.is_dir() and detect_format(path) == "video":
        raise SourceError(f"{path}: is a video, but a texture of flakes is an image; give a sheet")
    if settings.grid is None:
        header = read_header(path, max_pixels)
        return [lambda: decode(path, header)]
    reader = open_sheet(path, settings.grid, max_pixels)
    if reader.count > MAX_TEXTURE_CELLS:
        raise SourceError(
            f"{path}: has {reader.count} cells of {reader.width}x{reader.height} px, but a "
            f"texture of flakes may have {MAX_TEXTURE_CELLS}; use fewer, larger ones"
        )
    return [partial(reader.read, i) for i in range(reader.count)]
