"""Predict the files of a build: those it will certainly write, and those it may write."""

from collections.abc import Iterator

from fire_atlas.core.output_file import Role, is_named_after
from fire_atlas.engines.godot import names as godot
from fire_atlas.engines.unity import names as unity
from fire_atlas.formats.names import ENDINGS, flakes_file
from fire_atlas.outputs.manifest import manifest_name
from fire_atlas.recipe.gpu import channels_of, formats_for, texture_file
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import TemplateExport, UnityExport, export_name

_ENGINE_FILES: dict[str, tuple[tuple[str, Role], ...]] = {
    "godot": ((godot.FRAMES_ENDING, "scene"), (godot.SCENE_ENDING, "scene")),
    "unity": ((unity.CONTROLLER_ENDING, "engine"), (unity.PREFAB_ENDING, "engine")),
}
"""Endings and roles of the files that an engine's export writes for every scale."""

_IMPORT_ENDINGS = {"godot": godot.IMPORT_ENDING, "unity": unity.META_ENDING}
"""Endings of the import settings that an engine's export writes for each image."""


def expected_outputs(recipe: Recipe) -> Iterator[tuple[str, Role]]:
    """Yield the name and role of each output that a build of ``recipe`` will certainly write.

    The number of pages, the names that users' templates give, and which animations have flakes are
    known only once the frames are.
    """
    for scale in recipe.atlas.scales:
        yield from _sheet_files(recipe, recipe.name if scale == 1 else f"{recipe.name}@{scale:g}x")
    if recipe.atlas.pixels != "color":
        ramp = f"{recipe.name}.ramp.png"
        yield ramp, "ramp"
        yield from _import_settings(recipe, ramp)
    is_one = not recipe.atlas.members and recipe.views.count == 1 and not recipe.wind.levels
    if is_one and recipe.flakes != "none":
        for track in recipe.tracks:
            if track != "light":
                yield flakes_file(recipe.name, track), "tracks"
        for movie in recipe.movies:
            yield f"{recipe.name}.{movie}", "movie"
    yield manifest_name(recipe.name), "manifest"


def _sheet_files(recipe: Recipe, sheet: str) -> Iterator[tuple[str, Role]]:
    """Yield the files of one scale."""
    exports = [export_name(export) for export in recipe.exports]
    for image, kind in _images(recipe, sheet):
        yield image, "page" if kind == "page" else "map"
        for format_ in formats_for(recipe.atlas.gpu, channels_of(kind, recipe.atlas.pixels)):
            yield texture_file(image, format_), "texture"
        yield from _import_settings(recipe, image)
    for export in exports:
        for ending, described in _ENGINE_FILES.get(export, ()):
            yield sheet + ending, described
        if export in ENDINGS:
            yield sheet + ENDINGS[export], "atlas"


def _import_settings(recipe: Recipe, image: str) -> Iterator[tuple[str, Role]]:
    """Yield the files by which engines import an image."""
    exports = {export_name(export) for export in recipe.exports}
    for engine, ending in _IMPORT_ENDINGS.items():
        if engine in exports:
            yield image + ending, "import"


def _images(recipe: Recipe, sheet: str) -> Iterator[tuple[str, str]]:
    """Yield the first page of a sheet and the maps beside it, each with its kind."""
    ending = f".{recipe.atlas.format}"
    yield f"{sheet}{ending}", "page"
    motion = () if recipe.maps.motion == "none" else ("motion",)
    haze = ("haze",) if recipe.maps.haze else ()
    for kind in (*motion, *haze, *recipe.maps.layers, *recipe.maps.form):
        yield f"{sheet}.{kind}{ending}", kind
    if recipe.maps.emission == "exr":
        yield f"{sheet}.emission.exr", "emission"


def may_write(recipe: Recipe, file: str) -> bool:
    """Return whether a build of ``recipe`` may write a file of this name.

    All outputs are named after the recipe, but for a few of Unity's and those of users' templates.
    """
    if any(isinstance(export, TemplateExport) for export in recipe.exports):
        return True  # only the template knows its file's name
    plain = file.removesuffix(unity.META_ENDING)
    return is_named_after(recipe.name, file) or plain in _special(recipe)


def _special(recipe: Recipe) -> set[str]:
    """Return the names of Unity's files that do not begin with the recipe's name."""
    options = [export.unity for export in recipe.exports if isinstance(export, UnityExport)]
    assemblies = {f"{each.namespace}.asmdef" for each in options if each.assembly}
    scripts = {f"{unity.player_name(recipe.name, each)}.cs" for each in unity.PLAYED}
    return scripts | assemblies
