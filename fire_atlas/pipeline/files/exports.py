"""Write the formats a recipe names in ``exports`` and ``tracks``."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.errors import OutputError, about
from fire_atlas.core.output_file import OutputFile, as_file_name
from fire_atlas.core.progress import Progress
from fire_atlas.engines.engine import ENGINES, engine
from fire_atlas.formats.product import Product
from fire_atlas.formats.tables import EXPORTS, TRACKS
from fire_atlas.pipeline.files.moved import moved_images
from fire_atlas.recipe.output import (
    CssExport,
    Export,
    TemplateExport,
    TrackName,
    export_name,
    exports_called,
)

Exporter: TypeAlias = Callable[[Product], Iterator[OutputFile]]
"""Yields the files of an export for all scales."""

SheetExporter: TypeAlias = Callable[[AtlasSheet], Iterator[OutputFile]]
"""Yields the files of an export for one scale."""


def exported_files(
    exports: Sequence[Export], product: Product, templates: Mapping[str, Path]
) -> Iterator[OutputFile]:
    """Yield the files of all exports of a recipe.

    Args:
        exports: As in the recipe.
        product: The result of the build.
        templates: Paths of the user's templates, by their names in the recipe.

    Raises:
        FireAtlasError: Two files would be one on Windows or macOS, or an export cannot be written;
            about the key of the export.
    """
    taken = {as_file_name(file) for file in _image_files(product.sheets)}
    for i, export in enumerate(exports):
        with about(("exports", i)):
            for file in _files_of(export, product, templates):
                if (key := as_file_name(file.name)) in taken:
                    raise OutputError(_repeated(file.name, export))
                taken.add(key)
                yield file


def at_their_places(
    sheets: Sequence[AtlasSheet], exports: Sequence[Export], out: Path, progress: Progress
) -> tuple[AtlasSheet, ...]:
    """Return sheets whose images have the names under which they lie in the folder ``out`` now, if
    they were renamed in an engine's editor; note which.

    Raises:
        OutputError: That cannot be told.
    """
    places = moved_images(_image_files(sheets), exports, out)
    for file, place in places.items():
        progress.note(f"{file} lies at {place} now and is written there")
    return tuple(sheet.at(places) for sheet in sheets)


def note_what_engines_need(exports: Sequence[Export], product: Product, progress: Progress) -> None:
    """Note what an engine cannot play of the result, and what would let it."""
    for name in ENGINES:
        if any(exports_called(exports, name)):
            for advice in engine(name).advice(product):
                progress.note(advice)


def track_files(formats: Sequence[TrackName], product: Product) -> Iterator[OutputFile]:
    """Yield the flake tracks of each animation in each of ``formats``, then its light."""
    for stem, tracks in product.track_stems():
        for name in formats:
            if name != "light":
                yield TRACKS[name].write(stem, tracks)
    states = product.sheets[0].states
    for animation, light in product.lights.items():
        from fire_atlas.formats.tracks.light import write_light

        loop = None if states is None else product.lights[states.first_loop]
        yield write_light(product.stem(animation), light, loop)


def _files_of(
    export: Export, product: Product, templates: Mapping[str, Path]
) -> Iterator[OutputFile]:
    if not isinstance(export, TemplateExport):
        yield from exporter(export)(product)
        return
    from fire_atlas.formats.templates.export import export_template

    for sheet in product.sheets:
        yield export_template(sheet, export, templates[export.template])


def _image_files(sheets: Sequence[AtlasSheet]) -> list[str]:
    """Return the names of all images: pages, their maps, and the ramp of heat."""
    ramps = [sheet.heat.ramp for sheet in sheets[:1] if sheet.heat]
    return [file for sheet in sheets for file in sheet.files] + ramps


def _repeated(name: str, export: Export) -> str:
    if isinstance(export, TemplateExport):
        return (
            f"{export.template} would write {name}, which is another output already; "
            f"choose another `to`, with {{{{ name }}}} in it"
        )
    return f"{export_name(export)} would write {name} a second time; list it once"


def exporter(export: Export) -> Exporter:
    """Return the exporter for an entry of a recipe's ``exports``, with its options."""
    name = export_name(export)
    if name in ENGINES:
        return partial(engine(name).export, export=export)
    write: SheetExporter = EXPORTS[name].write
    if isinstance(export, CssExport):
        write = partial(EXPORTS[name].write, density=export.css.density)
    return lambda product: (file for sheet in product.sheets for file in write(sheet))
