"""Export a build to Godot: sprite frames, scenes, scripts, flakes, and how images are imported."""

from collections.abc import Iterator

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.engines.godot.flake_player import flake_player, played_arrays, played_flakes
from fire_atlas.engines.godot.flakes_in_space import flakes_in_space
from fire_atlas.engines.godot.flipbook import flipbook, flipbook_script
from fire_atlas.engines.godot.frames_resource import frames_resource
from fire_atlas.engines.godot.haze import haze_scene, haze_scripts
from fire_atlas.engines.godot.heat import heat_files
from fire_atlas.engines.godot.import_settings import KEEP, import_settings
from fire_atlas.engines.godot.names import IMPORT_ENDING
from fire_atlas.engines.godot.particle_scenes import particle_scenes
from fire_atlas.engines.godot.resources import image_uid
from fire_atlas.engines.godot.scene import scene, scene_scripts, summed_scene
from fire_atlas.engines.godot.single_sprites import single_sprites
from fire_atlas.formats.output_names import flakes_file
from fire_atlas.formats.product import Product


def export_godot(product: Product) -> Iterator[OutputFile]:
    """Yield sprite frames, scenes and single sprites of each scale, what all scales share, and
    import settings."""
    flakes, arrays = played_flakes(product), played_arrays(product)
    for sheet in product.sheets:
        yield from _page_settings(product, sheet)
        if sheet.animations:
            yield frames_resource(product, sheet)
            yield scene(product, sheet, flakes)
        if arrays:
            yield from summed_scene(product, sheet, arrays)
        yield from flipbook(product, sheet)
        yield from haze_scene(product, sheet)
        yield from single_sprites(product, sheet)
    if arrays:
        yield from flake_player(product, arrays)
    yield from flakes_in_space(product)
    yield from particle_scenes(product)
    yield from scene_scripts(product)
    yield from flipbook_script(product)
    yield from haze_scripts(product)
    yield from heat_files(product)
    if "csv" in product.track_formats:
        for stem, _ in product.track_stems():
            # Godot would import every CSV as translations.
            table = flakes_file(stem, "csv")
            yield OutputFile(table + IMPORT_ENDING, "import", KEEP)


def _page_settings(product: Product, sheet: AtlasSheet) -> Iterator[OutputFile]:
    for file in sheet.files:
        name = file + IMPORT_ENDING
        # Motion vectors are data: they must not be changed, as premultiplied light must not.
        is_data = any(file in sheet_map.files for sheet_map in sheet.maps if sheet_map.is_data)
        alpha = "premultiplied" if is_data else sheet.alpha
        data = import_settings(product.existing(name), alpha, image_uid(product, file))
        yield OutputFile(name, "import", data)
