"""Recipe keys of compressed textures: their formats by name, and how many mip levels they have."""

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Annotated, Literal, TypeAlias, get_args

from pydantic import Field

from fire_atlas.recipe.base import AUTO, NUMBER, either

GpuFormat = Literal[
    "bc1.dds", "bc1.ktx2", "bc3.dds", "bc3.ktx2", "bc4.dds", "bc4.ktx2", "bc5.dds", "bc5.ktx2",
    "bc7.dds", "bc7.ktx2", "astc-4x4.ktx2", "astc-5x5.ktx2", "astc-6x6.ktx2", "astc-8x8.ktx2",
    "etc2.ktx2", "eac-r11.ktx2", "eac-rg11.ktx2",
]  # fmt: skip
"""Formats of textures: how blocks of pixels are encoded, and the file that holds them."""

Supercompression: TypeAlias = Literal["none", "zstd"]
"""How levels in KTX2 files are compressed once more."""

GpuQuality: TypeAlias = Literal["final", "draft"]
"""How well blocks are encoded."""

Channels: TypeAlias = Literal[0, 1, 2, 4]
"""Number of channels of 8 bits that a client reads of an image: of colours 4, of vectors 2, of
light as floats 0."""

_OF_FEW: dict[tuple[str, ...], dict[Channels, str]] = {
    ("bc",): {1: "bc4", 2: "bc5"},
    ("etc", "eac"): {1: "eac-r11", 2: "eac-rg11"},
}
"""Formats of images with fewer channels than colours have, by how names of their family begin."""

MAX_MIPS = 15
"""Number of mip levels of the largest page."""

Mips = Annotated[
    Annotated[Literal["auto"], AUTO] | Annotated[int, Field(ge=1, le=MAX_MIPS), NUMBER],
    either(f"`auto` or a whole number from 1 to {MAX_MIPS}"),
]


def blocks_of(format_: str) -> str:
    """Return how blocks are encoded in a format: ``bc7`` of ``bc7.dds``."""
    return format_.partition(".")[0]


def blocks_suffix(blocks: Iterable[str]) -> str:
    """Return how pages are compressed, to be said behind the height of their frames; empty if there
    was no choice."""
    return "".join(f", {each}" for each in blocks)


def block_side(format_: str) -> int:
    """Return the width and height of a format's blocks, px."""
    blocks = blocks_of(format_)
    return int(blocks.rpartition("x")[2]) if blocks.startswith("astc") else 4


def channels_of(format_: str) -> Channels:
    """Return how many channels an image has at least for which a format is made: 4, 2 or 1."""
    few = ((name, channels) for names in _OF_FEW.values() for channels, name in names.items())
    return dict(few).get(blocks_of(format_), 4)


def formats_for(formats: Iterable[GpuFormat], channels: Channels) -> Iterator[GpuFormat]:
    """Yield the formats in which an image with so many channels is written.

    Images of fewer channels than colours have take BC4 and BC5 instead of other BC formats, and EAC
    instead of ETC2, which are as small or smaller and more exact; colours do not fit these.
    """
    written = list[GpuFormat]()
    for texture_format in formats:
        blocks, _, container = texture_format.partition(".")
        for family, names in _OF_FEW.items():
            if blocks.startswith(family):
                blocks = names.get(channels, blocks)
        if not channels or (channels == 4 and channels_of(blocks) < 4):
            continue
        written += [name for name in get_args(GpuFormat) if name == f"{blocks}.{container}"]
    yield from dict.fromkeys(written)


_FAMILIES = ("bc", "astc", "etc2")
"""What names of blocks begin with, by the devices that read them: a device reads one family."""


def choices_of_blocks(formats: Iterable[GpuFormat]) -> list[tuple[GpuFormat, ...]]:
    """Return each choice among formats of colours that leaves one kind of blocks to each family of
    devices: BC, ASTC, ETC2. DDS and KTX2 hold the same blocks, and stay together."""
    written = list(formats_for(formats, 4))
    families: dict[str, dict[str, None]] = {}
    for format_ in written:
        family = next(each for each in _FAMILIES if format_.startswith(each))
        families.setdefault(family, {})[blocks_of(format_)] = None
    return [
        tuple(format_ for format_ in written if blocks_of(format_) in chosen)
        for chosen in product(*families.values())
    ]


def page_channels(pixels: str) -> Channels:
    """Return how many channels of 8 bits clients read of pages that hold ``pixels``: ``color``,
    ``heat`` or ``heat4``."""
    return 1 if pixels == "heat" else 4


def texture_file(image: str, format_: GpuFormat) -> str:
    """Return the name of an image's texture: ``fire.motion.bc5.dds`` of ``fire.motion.png``."""
    return f"{image.rpartition('.')[0]}.{format_}"
