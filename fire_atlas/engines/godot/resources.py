"""Render the text files of a Godot project: scenes, resources, scripts and shaders."""

from collections.abc import Iterator
from typing import Any

from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH, SPRITE_INTEGRAL
from fire_atlas.engines.godot.names import IMPORT_ENDING, UID_ENDING, number, quoted, real, uid_of
from fire_atlas.formats.product import Product
from fire_atlas.formats.templates.jinja import rendered
from fire_atlas.recipe.effect import MAX_VARIANTS


def resource(template: str, name: str, product: Product, **context: Any) -> OutputFile:
    """Return a scene or resource."""
    text = rendered_text(template, uid=uid_of(product, name), **context)
    return OutputFile(name, "scene", text.encode())


def script(product: Product, ending: str, **context: Any) -> Iterator[OutputFile]:
    """Yield a script or a shader, and the file of its uid, which Godot 4.4 and later read."""
    name, uid = script_reference(product, ending)
    text = rendered_text(ending.removeprefix("_"), **context)
    yield OutputFile(name, "script", text.encode())
    yield OutputFile(name + UID_ENDING, "import", f"{uid}\n".encode())


def script_reference(product: Product, ending: str) -> tuple[str, str]:
    """Return the name and the uid of a script or a shader, by which resources refer to it."""
    name = f"{product.name}{ending}"
    return name, uid_of(product, name, stated_in=name + UID_ENDING)


def image_uid(product: Product, file: str) -> str:
    """Return the uid of an image, which its import settings state."""
    return uid_of(product, file, stated_in=file + IMPORT_ENDING)


def rendered_text(template: str, **context: Any) -> str:
    """Return a rendered template; all know how embers are drawn and how many sets
    of them there may be, as several draw them."""
    embers = {
        "halo_light": HALO_LIGHT,
        "halo_width": HALO_WIDTH,
        "flake_integral": 4 * SPRITE_INTEGRAL,
        "most_sets": MAX_VARIANTS,
    }
    return rendered(f"godot/{template}.j2", (number, real, quoted), **embers, **context)
