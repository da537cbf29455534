"""The memory that pages and maps take on a GPU, as a sheet alone tells it."""

from collections.abc import Iterator
from dataclasses import dataclass

from fire_atlas.atlas.sheet import AtlasSheet

UNCOMPRESSED = {"r8": 1, "rgba8": 4, "rgba16": 8, "rgba16f": 8}
"""Bytes of a pixel of the uncompressed formats: of pages, and of light as half floats."""


@dataclass(frozen=True, slots=True)
class ImageMemory:
    """An image as a GPU keeps it.

    Attributes:
        file: Name of the file that holds it.
        format: How its pixels are kept: ``rgba8``, ``bc7``, ...
        levels: Number of mip levels.
        memory: Bytes that it takes with these.
    """

    file: str
    format: str
    levels: int
    memory: int


def image_memories(sheet: AtlasSheet) -> Iterator[ImageMemory]:
    """Yield each page and map of a sheet, uncompressed and as each texture that is written of it.

    Uncompressed it has as many mip levels as its textures have, or one.
    """
    for number, page in enumerate(sheet.pages):
        for image in sheet.images(number):
            textures = sheet.textures_of(image)
            levels = max((texture.levels for texture in textures), default=1)
            sizes = ((max(page.width >> i, 1), max(page.height >> i, 1)) for i in range(levels))
            kept = _kept_as(sheet, image)
            size = sum(width * height * UNCOMPRESSED[kept] for width, height in sizes)
            yield ImageMemory(image, kept, levels, size)
            if textures:
                from fire_atlas.formats.textures.blocks import FORMATS
                from fire_atlas.formats.textures.gpu_texture import level_sizes

                for texture in textures:
                    blocks = FORMATS[texture.blocks]
                    sizes_of_levels = level_sizes(blocks, page.width, page.height, texture.levels)
                    yield ImageMemory(
                        texture.file, texture.blocks, texture.levels, sum(sizes_of_levels)
                    )


def _kept_as(sheet: AtlasSheet, image: str) -> str:
    """Return how an image's pixels are kept uncompressed."""
    if image.endswith(".exr"):
        return "rgba16f"
    if sheet.heat and sheet.heat.pixels == "heat" and image in {page.file for page in sheet.pages}:
        return "r8"
    found = sheet.map_of(image)
    return "rgba16" if sheet.bits == 16 and not (found and found.is_data) else "rgba8"


def memory_by_format(sheet: AtlasSheet) -> dict[str, int]:
    """Return how many bytes all images of a sheet take in each format that they are kept in.

    The two files of one format, DDS and KTX2, hold the same blocks: they count once.
    """
    taken: dict[str, int] = {}
    counted = set[tuple[str, str]]()
    for kept in image_memories(sheet):
        texture = kept.file.rpartition(".")[0], kept.format
        if texture not in counted:
            counted.add(texture)
            taken[kept.format] = taken.get(kept.format, 0) + kept.memory
    return taken


def largest_memory(sheet: AtlasSheet) -> int:
    """Return how many bytes a client keeps of a sheet at most: as its compressed textures, of which
    each client loads one format, or uncompressed where it has none."""
    taken = memory_by_format(sheet)
    if sheet.gpu:
        return max(size for kept, size in taken.items() if kept not in UNCOMPRESSED)
    return sum(taken.values())
