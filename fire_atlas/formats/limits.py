"""What the clients of several formats and engines cannot show."""

from collections.abc import Iterator, Sequence

from fire_atlas.recipe.output import Atlas, Export, ExportName, export_name, exports_called
from fire_atlas.recipe.problem import Problem


def upright_only(atlas: Atlas, exports: Sequence[Export], *names: ExportName) -> Iterator[Problem]:
    """Yield the exports called ``names`` where frames may lie rotated on their page."""
    if not atlas.rotate:
        return
    for path, export in exports_called(exports, *names):
        yield Problem(
            path,
            f"{export_name(export)} cannot be had with atlas.rotate: its clients show frames as "
            f"they lie on the page; set atlas.rotate to false",
        )
