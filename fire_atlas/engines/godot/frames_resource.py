"""The resource with the frames of the animations, which sprites play."""

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.meshes import SURFACE_FORMAT, surface_of
from fire_atlas.engines.godot.names import FRAMES_ENDING
from fire_atlas.engines.godot.resources import image_uid, resource
from fire_atlas.engines.godot.sprite_frames import FrameBounds, animations_of, textures_of
from fire_atlas.formats.product import Product


def frames_resource(product: Product, sheet: AtlasSheet) -> OutputFile:
    """Return the sprite frames of a scale, in meshes where it has some and shows colours."""
    name = sheet.name + FRAMES_ENDING
    pages = [(page.file, image_uid(product, page.file)) for page in sheet.pages]
    textures, texture_of_frame = textures_of(sheet, draws_meshes=sheet.heat is None)
    bounds = FrameBounds.of(sheet.regions)
    surfaces = [
        surface_of(texture, texture.mesh, sheet.pages[texture.page], bounds)
        if texture.mesh
        else None
        for texture in textures
    ]
    return resource(
        "frames.tres", name, product,
        pages=pages,
        textures=list(zip(textures, surfaces, strict=True)),
        surface_format=SURFACE_FORMAT,
        animations=animations_of(sheet, texture_of_frame),
    )  # fmt: skip
