"""Scenes of a fire whose hot air bends what is behind it."""

from collections.abc import Iterator

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.names import (
    HAZE_FRAMES,
    HAZE_PLAYER,
    HAZE_SCENE,
    HAZE_SHADER,
    SCENE_ENDING,
    node_name,
    titles,
    uid_of,
)
from fire_atlas.engines.godot.resources import image_uid, resource, script, script_reference
from fire_atlas.engines.godot.sprite_frames import FrameBounds, animations_of, textures_of
from fire_atlas.formats.product import Product


def haze_scene(product: Product, sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield a scene of the fire before its haze, and the frames of the haze, if it has any."""
    if not sheet.has_map("haze"):
        return
    haze, scene = sheet.map("haze"), sheet.name + SCENE_ENDING
    assert haze.vectors is not None
    frames = _haze_frames(product, sheet)
    yield frames
    yield resource(
        "haze.tscn", sheet.name + HAZE_SCENE, product,
        node=node_name(product.name),
        scene=(scene, uid_of(product, scene)),
        frames=(frames.name, uid_of(product, frames.name)),
        shader=script_reference(product, HAZE_SHADER),
        script=script_reference(product, HAZE_PLAYER),
        scale=haze.vectors.scale,
        first=next(iter(titles(animation.name for animation in sheet.animations).values())),
        bounds=FrameBounds.of(sheet.regions),
    )  # fmt: skip


def _haze_frames(product: Product, sheet: AtlasSheet) -> OutputFile:
    """Return the sprite frames of the haze. Meshes fit the flame, so it is drawn in rectangles."""
    textures, texture_of_frame = textures_of(sheet, draws_meshes=False)
    return resource(
        "frames.tres", sheet.name + HAZE_FRAMES, product,
        pages=[(file, image_uid(product, file)) for file in sheet.map("haze").files],
        textures=[(texture, None) for texture in textures],
        animations=animations_of(sheet, texture_of_frame),
    )  # fmt: skip


def haze_scripts(product: Product) -> Iterator[OutputFile]:
    """Yield the shader and the script of the scenes."""
    if product.sheets[0].has_map("haze"):
        yield from script(product, HAZE_SHADER)
        yield from script(product, HAZE_PLAYER)
