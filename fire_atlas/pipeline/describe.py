"""All files that describe what a build made."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.product import Product
from fire_atlas.pipeline.writers import exporter
from fire_atlas.recipe.output import Export, TemplateExport, export_name


def describe_product(
    exports: Sequence[Export],
    product: Product,
    templates: Mapping[str, Path],
) -> Iterator[OutputFile]:
    """Yield every export of what was built; ``templates`` says where each template lies."""
    taken = {file for sheet in product.sheets for file in sheet.files}
    for export in exports:
        for file in _files(export, product, templates):
            if file.name in taken:
                raise OutputError(_twice(file.name, export))
            taken.add(file.name)
            yield file


def _files(export: Export, product: Product, templates: Mapping[str, Path]) -> Iterator[OutputFile]:
    if not isinstance(export, TemplateExport):
        yield from exporter(export)(product)
        return
    from fire_atlas.formats.templates.user import export_template

    for sheet in product.sheets:
        yield export_template(sheet, export, templates[export.template])


def _twice(name: str, export: Export) -> str:
    if isinstance(export, TemplateExport):
        return (
            f"exports: {export.template} would write {name}, which is another output already; "
            f"choose another `to`, with {{{{ name }}}} in it"
        )
    return f"exports: {export_name(export)} would write {name} a second time; list it once"
