"""The smoke under the fire, in the scene of the fire."""

from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.engines.godot.resources import image_uid, rendered_text
from fire_atlas.formats.product import Product


def smoke_of(product: Product, sheet: AtlasSheet) -> dict[str, Any] | None:
    """Return what the template of a scene needs of the smoke under the fire; None if the scene
    shows none."""
    files = [
        file for sheet_map in sheet.maps if sheet_map.kind == "smoke" for file in sheet_map.files
    ]
    if len(files) != 1 or sheet.heat is not None:
        return None
    unshaded = bool(product.tracks or product.lights)
    shader = rendered_text("smoke.gdshader", pixel_art=product.pixel_art, unshaded=unshaded)
    return {"image": (files[0], image_uid(product, files[0])), "shader": shader}


def why_smoke_is_not_shown(product: Product) -> str | None:
    """Return advice if there is smoke, but the scene shows the fire without it."""
    sheet = product.sheets[0]
    if not any(sheet_map.kind == "smoke" for sheet_map in sheet.maps) or smoke_of(product, sheet):
        return None
    reason = f"its shader has one page of {len(sheet.pages)}; raise atlas.max_size"
    if sheet.heat is not None:
        reason = "the shader of heat has no smoke; set atlas.pixels: color"
    return f"maps.smoke: the scene shows the fire without its smoke: {reason}"
