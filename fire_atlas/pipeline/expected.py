"""Which files a build will write, as far as that is known before any work is done."""

from collections.abc import Iterator

from fire_atlas.core.output_file import Role
from fire_atlas.formats.names import flakes_file
from fire_atlas.outputs.manifest import manifest_name
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import export_name

_DESCRIPTIONS: dict[str, tuple[tuple[str, Role], ...]] = {
    "json": ((".json", "atlas"),),
    "json-array": ((".array.json", "atlas"),),
    "phaser": ((".phaser.json", "atlas"),),
    "aseprite": ((".aseprite.json", "atlas"),),
    "css": ((".css", "atlas"),),
    "tpsheet": ((".tpsheet", "atlas"),),
    "godot": ((".tres", "scene"), (".tscn", "scene")),
    "unity": ((".controller", "engine"), (".prefab", "engine")),
}
"""Endings and roles of what each export writes of every scale, whatever the frames are."""

_SETTINGS = {"godot": ".import", "unity": ".meta"}
"""Endings of the import settings that an engine's export writes beside each image."""


def expected_outputs(recipe: Recipe) -> Iterator[tuple[str, Role]]:
    """Yield name and role of outputs that a build of ``recipe`` is sure to write.

    How many pages there are, what a user's template is called, and whose flakes there are is known
    only when the frames are.
    """
    for scale in recipe.atlas.scales:
        yield from _of_sheet(recipe, recipe.name if scale == 1 else f"{recipe.name}@{scale:g}x")
    if not recipe.atlas.members and recipe.views.count == 1 and recipe.flakes != "none":
        for track in recipe.tracks:
            if track != "light":
                yield flakes_file(recipe.name, track), "tracks"
    yield manifest_name(recipe.name), "manifest"


def _of_sheet(recipe: Recipe, sheet: str) -> Iterator[tuple[str, Role]]:
    """Yield what is written of one scale."""
    exports = [export_name(export) for export in recipe.exports]
    for image, role in _images(recipe, sheet):
        yield image, role
        for engine in _SETTINGS.keys() & exports:
            yield image + _SETTINGS[engine], "import"
    for export in exports:
        for ending, described in _DESCRIPTIONS.get(export, ()):
            yield sheet + ending, described


def _images(recipe: Recipe, sheet: str) -> Iterator[tuple[str, Role]]:
    """Yield the first page of a sheet, and what lies beside it."""
    ending = f".{recipe.atlas.format}"
    yield f"{sheet}{ending}", "page"
    motion = () if recipe.maps.motion == "none" else ("motion",)
    for kind in (*motion, *recipe.maps.layers):
        yield f"{sheet}.{kind}{ending}", "map"
