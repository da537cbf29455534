"""Pages of heat: the shader that looks their colours up, in the scene of the fire."""

from collections.abc import Iterator
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.flake_player import played_flakes
from fire_atlas.engines.godot.import_settings import import_settings
from fire_atlas.engines.godot.names import FILM_SCENE, HEAT_PLAYER, HEAT_SHADER, IMPORT_ENDING
from fire_atlas.engines.godot.resources import image_uid, script, script_reference
from fire_atlas.formats.product import Product


def heat_of(product: Product, sheet: AtlasSheet) -> dict[str, Any] | None:
    """Return what the template of a scene needs of pages of heat; None if they have colours."""
    if sheet.heat is None:
        return None
    return {
        "ramp": (sheet.heat.ramp, image_uid(product, sheet.heat.ramp)),
        "shader": script_reference(product, HEAT_SHADER),
        "script": script_reference(product, HEAT_PLAYER),
        "four_in_one": sheet.heat.pixels == "heat4",
    }


def heat_files(product: Product) -> Iterator[OutputFile]:
    """Yield the shader and script of pages of heat, and how the ramp is imported."""
    heat = product.sheets[0].heat
    if heat is None:
        return
    unshaded = bool(product.tracks or product.lights)
    yield from script(product, HEAT_SHADER, pixel_art=product.pixel_art, unshaded=unshaded)
    yield from script(product, HEAT_PLAYER)
    name, uid = heat.ramp + IMPORT_ENDING, image_uid(product, heat.ramp)
    settings = import_settings(product.existing(name), "premultiplied", uid)
    yield OutputFile(name, "import", settings)


def why_heat_is_drawn_alone(product: Product) -> str | None:
    """Return advice if pages of heat leave out what pages of colours have."""
    sheet = product.sheets[0]
    if sheet.heat is None:
        return None
    lost = ["meshes (the scene draws rectangles)"] if sheet.has_meshes else []
    if product.tracks and not product.baked.issuperset(played_flakes(product)):
        lost.append(product.name + FILM_SCENE)
    return f"atlas.pixels: in Godot, heat has no {' and no '.join(lost)}" if lost else None
