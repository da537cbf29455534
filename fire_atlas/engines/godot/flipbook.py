"""Scenes that play a sheet along its motion vectors, each frame warped into the next."""

from collections.abc import Iterator

from fire_atlas.atlas.sheet import AtlasSheet, VectorScale
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.names import (
    MOTION_MATERIAL,
    MOTION_PLAYER,
    MOTION_SCENE,
    MOTION_SHADER,
    node_name,
    title_in_godot,
    uid_of,
)
from fire_atlas.engines.godot.resources import image_uid, resource, script, script_reference
from fire_atlas.engines.godot.sprite_frames import pivot
from fire_atlas.formats.product import Product


def flipbook(product: Product, sheet: AtlasSheet) -> Iterator[OutputFile]:
    """Yield the material that plays a sheet along its motion vectors, and a scene of a sprite."""
    motion = _played_motion(sheet)
    if motion is None:
        return
    (vectors,), (animation,), first = sheet.map("motion").files, sheet.animations, sheet.regions[0]
    material, count = sheet.name + MOTION_MATERIAL, len(sheet.regions)
    yield resource(
        "motion.tres", material, product,
        sheet=sheet,
        shader=script_reference(product, MOTION_SHADER),
        vectors=(vectors, image_uid(product, vectors)),
        scale=motion.scale,
    )  # fmt: skip
    last, seconds = count if animation.loop else count - 1, first.duration / 1000
    x, y = pivot(first)
    yield resource(
        "motion.tscn", sheet.name + MOTION_SCENE, product,
        node=node_name(product.name),
        sheet=sheet,
        page=(sheet.pages[0].file, image_uid(product, sheet.pages[0].file)),
        material=(material, uid_of(product, material)),
        script=script_reference(product, MOTION_PLAYER),
        animation=animation,
        title=title_in_godot(animation.name),
        length=count * seconds,
        last=(last * seconds, last),
        offset=(first.trim_x - first.x - x, first.trim_y - first.y - y),
        pixel_art=product.pixel_art,
    )  # fmt: skip


def flipbook_script(product: Product) -> Iterator[OutputFile]:
    """Yield the shader and the script of the flipbooks, if there are any."""
    if any(_played_motion(sheet) for sheet in product.sheets):
        yield from script(product, MOTION_SHADER)
        yield from script(product, MOTION_PLAYER)


def _played_motion(sheet: AtlasSheet) -> VectorScale | None:
    """Return the motion vectors along which a shader can play a sheet: those of a grid on one page,
    of one animation; None without."""
    is_one = len(sheet.pages) == len(sheet.animations) == 1 and sheet.grid is not None
    is_one = is_one and sheet.heat is None
    is_played = is_one and sheet.motion is not None and sheet.motion.engine == "godot"
    return sheet.motion if is_played else None


def why_motion_is_not_played(product: Product) -> str | None:
    """Return advice if there are motion vectors for Godot, but no scene that plays along them."""
    sheet = product.sheets[0]
    if sheet.motion is None or sheet.motion.engine != "godot" or _played_motion(sheet):
        return None
    if sheet.heat is not None:
        reason = "it shows colours alone; set atlas.pixels: color"
    elif sheet.grid is None:
        reason = "its frames are packed, and it needs cells of one size; set atlas.layout: grid"
    elif len(sheet.animations) > 1:
        reason = f"it plays one animation of {len(sheet.animations)}; give each its own recipe"
    else:
        reason = (
            f"it plays one page of {len(sheet.pages)}; set a larger atlas.max_size, or a smaller "
            "source.height or source.size"
        )
    return f"maps.motion: no {sheet.name}{MOTION_SCENE} plays along the vectors: {reason}"
