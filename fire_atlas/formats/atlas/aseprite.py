"""Aseprite's JSON array as Phaser's loader of it wants it, with frames called "0", "1", ..."""

from collections.abc import Iterator

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.atlas.json_array import array_text


def export_aseprite(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.aseprite.json``: frames called "0", "1", ..., as Phaser's Aseprite loader wants.

    Raises:
        OutputError: There are several pages, of which that loader knows but one.
    """
    if len(sheet.pages) > 1:
        raise OutputError(
            f"exports: aseprite describes one page, but {sheet.name} needs {len(sheet.pages)}; "
            f"raise atlas.max_size, or export phaser instead"
        )
    numbers = [str(i) for i in range(len(sheet.regions))]
    text = array_text(sheet, 0, sheet.regions, numbers)
    yield OutputFile(sheet.file(0, ".aseprite.json"), "atlas", text.encode())
