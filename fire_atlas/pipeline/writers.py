"""Write the formats a recipe names in ``exports`` and ``tracks``.

A new format is a module and a case here; the type checker demands the case once the name is in
``fire_atlas.recipe.output``. Writers are imported only when a recipe names them.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias, assert_never

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import OutputFile, as_file_name
from fire_atlas.core.progress import Progress
from fire_atlas.formats.product import Product
from fire_atlas.formats.tracks.writers import track_writer
from fire_atlas.recipe.output import (
    EngineExport,
    Export,
    ExportName,
    GodotExport,
    GodotOptions,
    TemplateExport,
    TrackName,
    UnityExport,
    UnityOptions,
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
        OutputError: Two files would be one on Windows or macOS.
    """
    taken = {as_file_name(file) for sheet in product.sheets for file in sheet.files}
    taken |= {as_file_name(sheet.heat.ramp) for sheet in product.sheets if sheet.heat}
    for export in exports:
        for file in _files_of(export, product, templates):
            if (key := as_file_name(file.name)) in taken:
                raise OutputError(_repeated(file.name, export))
            taken.add(key)
            yield file


def note_what_engines_need(exports: Sequence[Export], product: Product, progress: Progress) -> None:
    """Note what an engine cannot play of the result, and what would let it."""
    for _, export in exports_called(exports, "godot"):
        from fire_atlas.engines.godot.advice import what_is_not_shown

        options = export.godot if isinstance(export, GodotExport) else GodotOptions()
        for advice in what_is_not_shown(product, options):
            progress.note(advice)
    if product.sheets[0].cells and any(exports_called(exports, "unity")):
        progress.note(
            "flakes.texture: Unity's player draws flakes as soft streaks, not with the texture; "
            "the pages have its cells as sprites, and flakes.bake: true draws flakes into frames"
        )


def track_files(formats: Sequence[TrackName], product: Product) -> Iterator[OutputFile]:
    """Yield the flake tracks of each animation in each of ``formats``, then its light."""
    for animation, tracks in product.tracks.items():
        for name in formats:
            if name != "light":
                yield track_writer(name)(product.stem(animation), tracks)
    for animation, light in product.lights.items():
        from fire_atlas.formats.tracks.light import write_light

        yield write_light(product.stem(animation), light)


def _files_of(
    export: Export, product: Product, templates: Mapping[str, Path]
) -> Iterator[OutputFile]:
    if not isinstance(export, TemplateExport):
        yield from exporter(export)(product)
        return
    from fire_atlas.formats.templates.export import export_template

    for sheet in product.sheets:
        yield export_template(sheet, export, templates[export.template])


def _repeated(name: str, export: Export) -> str:
    if isinstance(export, TemplateExport):
        return (
            f"exports: {export.template} would write {name}, which is another output already; "
            f"choose another `to`, with {{{{ name }}}} in it"
        )
    return f"exports: {export_name(export)} would write {name} a second time; list it once"


def exporter(export: ExportName | EngineExport) -> Exporter:
    """Return the exporter for an entry of a recipe's ``exports``, with its options."""
    match export:
        case "json":
            from fire_atlas.formats.atlas.texture_packer import export_json_hash

            return _for_each_sheet(export_json_hash)
        case "json-array":
            from fire_atlas.formats.atlas.texture_packer import export_json_array

            return _for_each_sheet(export_json_array)
        case "phaser":
            from fire_atlas.formats.atlas.phaser import export_phaser

            return _for_each_sheet(export_phaser)
        case "aseprite":
            from fire_atlas.formats.atlas.texture_packer import export_aseprite

            return _for_each_sheet(export_aseprite)
        case "css":
            from fire_atlas.formats.templates.export import export_css

            return _for_each_sheet(export_css)
        case "tpsheet":
            from fire_atlas.formats.templates.export import export_tpsheet

            return _for_each_sheet(export_tpsheet)
        case "godot":
            return exporter(GodotExport(godot=GodotOptions()))
        case GodotExport():
            from fire_atlas.engines.godot.export import export_godot

            return partial(export_godot, options=export.godot)
        case "unity":
            return exporter(UnityExport(unity=UnityOptions()))
        case UnityExport():
            from fire_atlas.engines.unity.export import export_unity

            return partial(export_unity, options=export.unity)
        case _:
            assert_never(export)


def _for_each_sheet(export: SheetExporter) -> Exporter:
    """Return the exporter that applies ``export`` to every scale."""
    return lambda product: (file for sheet in product.sheets for file in export(sheet))
