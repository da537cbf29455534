"""Single sprites as Godot's users expect them: an ``AtlasTexture`` each, and a ``StyleBoxTexture``
for those that are nine-patches."""

from collections.abc import Iterator

from fire_atlas.atlas.sheet import AtlasSheet, Region
from fire_atlas.core.errors import OutputError
from fire_atlas.core.output_file import OutputFile, as_file_name, is_portable
from fire_atlas.engines.godot.names import BOX_ENDING, SPRITE_ENDING
from fire_atlas.engines.godot.resources import image_uid, resource
from fire_atlas.formats.product import Product


def single_sprites(product: Product, sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield the resources of a sheet's single sprites; in their names, ``/`` is ``-``.

    Raises:
        OutputError: Two would be one file, or a name is too long for one.
    """
    taken = dict[str, str]()
    for region in sheet.singles:
        stem = f"{sheet.name}.{region.name.replace('/', '-')}"
        other = taken.setdefault(as_file_name(stem), region.name)
        if other != region.name:
            raise OutputError(
                f"exports: godot cannot tell the sprites {other} and {region.name} apart: the file "
                f"of both would be {stem}{SPRITE_ENDING}; rename the file of one of them"
            )
        if not is_portable(stem + BOX_ENDING):
            raise OutputError(
                f"exports: godot needs a file for the sprite {region.name}, whose name is too "
                f"long for one; rename it"
            )
        yield _resource("sprite.tres", stem + SPRITE_ENDING, product, sheet, region)
        if region.border is not None:
            yield _resource("stylebox.tres", stem + BOX_ENDING, product, sheet, region)


def _resource(
    template: str, name: str, product: Product, sheet: AtlasSheet, region: Region
) -> OutputFile:
    page = sheet.pages[region.page].file
    return resource(
        template, name, product, page=page, page_uid=image_uid(product, page), region=region
    )
