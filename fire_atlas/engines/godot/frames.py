"""The resource with the frames of the animations, which sprites play."""

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.meshes import SURFACE_FORMAT, surface_of
from fire_atlas.engines.godot.names import FRAMES_ENDING
from fire_atlas.engines.godot.resources import image_uid, resource
from fire_atlas.engines.godot.sprite_frames import FrameBounds, animations_of, textures_of
from fire_atlas.formats.product import Product
from fire_atlas.recipe.output import GodotOptions


def frames_resource(product: Product, sheet: AtlasSheet, options: GodotOptions) -> OutputFile:
    """Return the sprite frames of a scale, in meshes if it has some that Godot draws right."""
    name = sheet.name + FRAMES_ENDING
    pages = [(page.file, image_uid(product, page.file)) for page in sheet.pages]
    draws_meshes = options.version == 4 and sheet.heat is None
    textures, texture_of_frame = textures_of(sheet, draws_meshes=draws_meshes)
    bounds = FrameBounds.of(sheet.regions)
    surfaces = [
        surface_of(each, each.mesh, sheet.pages[each.page], bounds) if each.mesh else None
        for each in textures
    ]
    return resource(
        "frames.tres", name, product, options,
        pages=pages,
        textures=list(zip(textures, surfaces, strict=True)),
        surface_format=SURFACE_FORMAT,
        animations=animations_of(sheet, texture_of_frame, options),
    )  # fmt: skip


def why_meshes_are_not_drawn(product: Product, options: GodotOptions) -> str | None:
    """Return advice if frames have meshes, but the scene draws their rectangles."""
    if options.version == 4 or not product.sheets[0].has_meshes:
        return None
    return "atlas.mesh: the scene draws rectangles: only Godot 4 draws meshes right; set version: 4"
