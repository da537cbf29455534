"""Single sprites as Godot's users expect them: an ``AtlasTexture`` each, and a ``StyleBoxTexture``
for those that are nine-patches."""

from collections.abc import Iterator

from fire_atlas.atlas.sheet import AtlasSheet, Region
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.names import BOX_ENDING, SPRITE_ENDING, single_stems
from fire_atlas.engines.godot.resources import image_uid, resource
from fire_atlas.formats.product import Product


def single_sprites(product: Product, sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield the resources of a sheet's single sprites.

    Raises:
        OutputError: Two would be one file, or a name is too long for one.
    """
    stems = single_stems(sheet.name, (region.name for region in sheet.singles))
    for region in sheet.singles:
        stem = stems[region.name]
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
