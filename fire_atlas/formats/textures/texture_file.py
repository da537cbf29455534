"""Write and read the files of compressed textures: DDS and KTX2."""

from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import MIB, read_file
from fire_atlas.formats.textures.dds import read_dds, write_dds
from fire_atlas.formats.textures.gpu_texture import TextureHeader
from fire_atlas.formats.textures.ktx2 import read_ktx2, write_ktx2

_MAX_BYTES = 512 * MIB
"""Maximum size of a file: more than that of 16384 x 16384 px with all mip levels."""


def write_texture(
    file: BinaryIO, name: str, header: TextureHeader, levels: Sequence[bytes]
) -> None:
    """Write the file ``name``, whose ending decides its format; ``levels`` are encoded,
    and supercompressed if the header says so."""
    write = write_dds if name.endswith(".dds") else write_ktx2
    write(file, header, levels)


def read_texture(path: Path) -> TextureHeader:
    """Return what the file of a texture says of it.

    Raises:
        SourceError: It is missing, damaged, or not as this tool writes it.
    """
    read = read_dds if path.suffix == ".dds" else read_ktx2
    try:
        return read(read_file(path, _MAX_BYTES))
    except OSError as error:
        raise SourceError(f"{path}: the texture cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise SourceError(f"{path}: {error}; build the recipe again") from None
