"""Predict the files of a build: those it will certainly write, and those it may write."""

import re
from collections.abc import Iterator
from pathlib import PurePath

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

    Names are exact but for numbers of pages, names of animations and what templates fill in. What
    an editor compiles, or a system runs, is only what the recipe's own exports are called.
    """
    if any(_fits_template(export.to, file) for export in _templates(recipe)):
        return True
    exports = {export_name(export) for export in recipe.exports}
    plain = file
    if "godot" in exports:
        plain = plain.removesuffix(godot.IMPORT_ENDING).removesuffix(godot.UID_ENDING)
    if "unity" in exports:
        plain = plain.removesuffix(unity.META_ENDING)
    if plain in _scripts(recipe, exports):
        return True
    return is_named_after(recipe.name, plain) and plain.endswith(tuple(_endings(recipe, exports)))


def _templates(recipe: Recipe) -> list[TemplateExport]:
    return [export for export in recipe.exports if isinstance(export, TemplateExport)]


_PROGRAMS = (
    ".asmdef", ".asmref", ".bat", ".cmd", ".com", ".cs", ".dll", ".dylib", ".exe", ".gd", ".jar",
    ".js", ".lua", ".mjs", ".ps1", ".py", ".rsp", ".sh", ".so", ".ts", ".vbs", ".wasm",
)  # fmt: skip
"""Endings of what an editor compiles as it finds it in a project, or a system runs."""

_FILLED_IN = re.compile(r"\{\{.*?\}\}|\{%.*?%\}|\{#.*?#\}", re.DOTALL)
"""What Jinja replaces."""


def _fits_template(to: str, file: str) -> bool:
    """Return whether a template whose file is called ``to`` may write ``file``."""
    literal = map(re.escape, _FILLED_IN.split(to))
    if not re.fullmatch(r"[^/\\]*".join(literal), file):
        return False
    ending = PurePath(file).suffix.lower()
    return ending not in _PROGRAMS or to.lower().endswith(ending)


def _scripts(recipe: Recipe, exports: set[str]) -> set[str]:
    """Return the names of scripts that a build may write, and of Unity's files beside them."""
    names = set[str]()
    if "godot" in exports:
        names |= {f"{recipe.name}{ending}" for ending in godot.SCRIPTS}
    if "unity" in exports:
        options = [export.unity for export in recipe.exports if isinstance(export, UnityExport)]
        names |= {f"{each.namespace}.asmdef" for each in options if each.assembly}
        names |= {f"{unity.player_name(recipe.name, each)}.cs" for each in unity.PLAYED}
    return names


_ENDINGS_OF_ENGINES: dict[str, tuple[str, ...]] = {
    "godot": (godot.FRAMES_ENDING, godot.SCENE_ENDING, ".gdshader"),
    "unity": (
        unity.CONTROLLER_ENDING, unity.PREFAB_ENDING, ".anim", ".flakes.bytes", ".mat", ".shader",
    ),
}  # fmt: skip
"""Endings of what an engine's export writes besides scripts."""


def _endings(recipe: Recipe, exports: set[str]) -> Iterator[str]:
    """Yield the endings of all outputs of a recipe that are no scripts."""
    yield f".{recipe.atlas.format}"
    if recipe.atlas.pixels != "color":
        yield ".ramp.png"
    if recipe.maps.emission == "exr":
        yield ".emission.exr"
    if recipe.atlas.gpu:
        yield from (".dds", ".ktx2")
    for export in exports:
        yield from _ENDINGS_OF_ENGINES.get(export, ())
        if export in ENDINGS:
            yield ENDINGS[export]
    for track in recipe.tracks:
        yield ".light.json" if track == "light" else flakes_file("", track)
    for movie in recipe.movies:
        yield f".{movie}"
