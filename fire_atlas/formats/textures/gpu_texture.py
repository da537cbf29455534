"""A compressed texture: what its file says, and the bytes of its mip levels."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from fire_atlas.formats.textures.blocks import BlockFormat
from fire_atlas.recipe.gpu import Supercompression

AlphaMode: TypeAlias = Literal["straight", "premultiplied", "opaque", "unstated"]
"""``opaque``: there is none; ``unstated``: a file that was read does not say."""


@dataclass(frozen=True, slots=True)
class TextureHeader:
    """What the file of a texture says of it.

    Attributes:
        format: How its blocks are encoded.
        width, height: Size of its first level, px.
        srgb: Whether a GPU decodes colours from sRGB as it samples them.
        alpha: How alpha is stored.
        sizes: Bytes of the blocks of each mip level, the largest first.
        supercompression: How levels are compressed once more in the file.
    """

    format: BlockFormat
    width: int
    height: int
    srgb: bool
    alpha: AlphaMode
    sizes: tuple[int, ...]
    supercompression: Supercompression = "none"

    @property
    def memory(self) -> int:
        """Bytes that it takes on a GPU: its blocks are kept there as they are."""
        return sum(self.sizes)


def level_sizes(format_: BlockFormat, width: int, height: int, levels: int) -> tuple[int, ...]:
    """Return the bytes of each mip level of a texture of that size."""
    return tuple(
        format_.level_bytes(max(width >> level, 1), max(height >> level, 1))
        for level in range(levels)
    )
