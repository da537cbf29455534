"""Find the images of a build that were renamed in an engine's editor. Imports nothing heavy."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from fire_atlas.engines.engine import ENGINES, engine
from fire_atlas.recipe.output import Export, exports_called


def moved_images(files: Sequence[str], exports: Sequence[Export], out: Path) -> Mapping[str, str]:
    """Return where images lie below ``out`` that were renamed, by the names a build gives them.

    Raises:
        OutputError: That cannot be told.
    """
    moved = dict[str, str]()
    for name in ENGINES:
        for _, export in exports_called(exports, name):
            moved |= engine(name).moved(out, files, export)
    return moved
