"""Render the text files of a Godot project: scenes, resources, scripts and shaders."""

from collections.abc import Iterator
from typing import Any

from fire_atlas.core.output_file import OutputFile
from fire_atlas.effect.flakes.drawing import HALO_LIGHT, HALO_WIDTH, SPRITE_INTEGRAL
from fire_atlas.engines.godot.names import IMPORT_ENDING, UID_ENDING, number, quoted, real, uid_of
from fire_atlas.formats.product import Product
from fire_atlas.formats.templates.jinja import rendered
from fire_atlas.recipe.output import GodotOptions


def resource(
    template: str, name: str, product: Product, options: GodotOptions, **context: Any
) -> OutputFile:
    """Return a scene or resource; its parts are marked by strings in Godot 4, by numbers in 3."""
    text = rendered_text(
        template,
        version=options.version,
        uid=uid_of(product, name),
        mark=lambda i: f'"{i}"' if options.version == 4 else i,
        **context,
    )
    return OutputFile(name, "scene", text.encode())


def script(
    product: Product, ending: str, options: GodotOptions, **context: Any
) -> Iterator[OutputFile]:
    """Yield a script or a shader, and for Godot 4.4 and later the file of its uid."""
    name, uid = script_reference(product, ending)
    text = rendered_text(ending.removeprefix("_"), version=options.version, **context)
    yield OutputFile(name, "script", text.encode())
    if options.version == 4:
        yield OutputFile(name + UID_ENDING, "import", f"{uid}\n".encode())


def script_reference(product: Product, ending: str) -> tuple[str, str]:
    """Return the name and the uid of a script or a shader, by which resources refer to it."""
    name = f"{product.name}{ending}"
    return name, uid_of(product, name, stated_in=name + UID_ENDING)


def image_uid(product: Product, file: str) -> str:
    """Return the uid of an image, which its import settings state."""
    return uid_of(product, file, stated_in=file + IMPORT_ENDING)


def rendered_text(template: str, **context: Any) -> str:
    """Return a rendered template; all know how embers are drawn, as several draw them."""
    embers = {
        "halo_light": HALO_LIGHT,
        "halo_width": HALO_WIDTH,
        "flake_integral": 4 * SPRITE_INTEGRAL,
    }
    return rendered(f"godot/{template}.j2", (number, real, quoted), **embers, **context)
