"""The memory that pages and maps take on a GPU, in each format that they have."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Self

from fire_atlas.core.errors import SourceError
from fire_atlas.core.statistics import read_figures
from fire_atlas.formats.atlas.texture_packer import AtlasFile
from fire_atlas.formats.pages.colour_error import ColourError
from fire_atlas.formats.textures.error import TextureError
from fire_atlas.formats.textures.memory import ImageMemory, image_memories
from fire_atlas.formats.textures.texture_file import read_texture


@dataclass(frozen=True, slots=True)
class ImageErrors:
    """How far files are from what was drawn, as the manifest states it, by their names.

    Attributes:
        pages: Of lossy pages.
        textures: Of compressed textures.
    """

    pages: Mapping[str, ColourError]
    textures: Mapping[str, TextureError]

    @classmethod
    def of(cls, statistics: dict[str, Any]) -> Self:
        """Return what the statistics of a manifest say.

        Raises:
            ValueError: They are invalid.
        """
        return cls(
            read_figures(statistics, "colour_error", ColourError),
            read_figures(statistics, "gpu", TextureError),
        )


@dataclass(frozen=True, slots=True)
class TextureUse(ImageMemory):
    """An image as a GPU keeps it, and how well.

    Attributes:
        psnr: Peak signal-to-noise ratio, dB, beside what was drawn; None if it is exact or unknown.
        hue: Distance of hues, ΔE, beside what was drawn; None likewise.
    """

    psnr: float | None = None
    hue: float | None = None


def texture_uses(atlas: AtlasFile, errors: ImageErrors) -> Iterator[TextureUse]:
    """Yield each page and map, uncompressed and as the textures that were written of it.

    Raises:
        SourceError: A texture is missing, damaged, or not as the atlas states.
    """
    of_page = {
        image: page for i, page in enumerate(atlas.sheet.pages) for image in atlas.sheet.images(i)
    }
    of_texture = {texture.file: of_page[texture.image] for texture in atlas.sheet.gpu}
    for kept in image_memories(atlas.sheet):
        if page := of_texture.get(kept.file):
            yield _compressed(atlas, kept.file, (page.width, page.height), errors)
        else:
            lossy = errors.pages.get(kept.file)
            psnr = lossy.psnr if lossy else None
            yield TextureUse(kept.file, kept.format, kept.levels, kept.memory, psnr)


def _compressed(
    atlas: AtlasFile, file: str, size: tuple[int, int], errors: ImageErrors
) -> TextureUse:
    header = read_texture(atlas.path.parent / file)
    if (header.width, header.height) != size:
        raise SourceError(
            f"{atlas.path.parent / file}: is {header.width}x{header.height}, but its page is "
            f"{size[0]}x{size[1]}; build the recipe again"
        )
    error = errors.textures.get(file)
    figures = (error.psnr, error.hue) if error else (None, None)
    return TextureUse(file, header.format.name, len(header.sizes), header.memory, *figures)
