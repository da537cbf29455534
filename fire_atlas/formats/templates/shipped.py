"""Text formats that are templates of our own."""

from collections.abc import Iterator

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.templates.context import context_of
from fire_atlas.formats.templates.jinja import rendered


def export_css(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.css``: a class that plays each animation, and one for each frame."""
    text = rendered("sprites.css.j2", **context_of(sheet))
    yield OutputFile(sheet.file(0, ".css"), "atlas", text.encode())


def export_tpsheet(sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield ``name.tpsheet``, ``name-1.tpsheet``, ...: each describes one page."""
    context = context_of(sheet)
    for i, page in enumerate(context["pages"]):
        text = rendered("sprites.tpsheet.j2", **context, page=page)
        yield OutputFile(sheet.file(i, ".tpsheet"), "atlas", text.encode())
