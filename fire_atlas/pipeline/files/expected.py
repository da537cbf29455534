"""Which files a recipe writes: the one answer to that, for all who ask before a build or without.

It is exact but for the number of pages, the names of animations, and what templates fill in.
"""

import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from glob import escape
from pathlib import PurePath

from fire_atlas.core.output_file import Role
from fire_atlas.engines.engine import ENGINES, engine
from fire_atlas.formats.output_names import (
    OfEach,
    OutputNames,
    light_file,
)
from fire_atlas.formats.tables import EXPORTS, MOVIES, TRACKS
from fire_atlas.maps.kinds import kinds_in
from fire_atlas.outputs.manifest import manifest_name
from fire_atlas.recipe.gpu import Channels, formats_for, page_channels, texture_file
from fire_atlas.recipe.models import Recipe
from fire_atlas.recipe.output import (
    TemplateExport,
    export_name,
)


def files(recipe: Recipe) -> Iterator[OutputNames]:
    """Yield the names of all files that builds of ``recipe`` write, but those of users' templates,
    which ``unexpected`` knows."""
    stems = [_stem(recipe.name, scale) for scale in recipe.atlas.scales]
    of_no_engine = [*_sheet_files(recipe, stems), *_animation_files(recipe)]
    if recipe.atlas.pixels != "color":
        of_no_engine.append(OutputNames(recipe.name, ".ramp.png", "ramp", is_certain=True))
    yield from of_no_engine
    for export in recipe.exports:
        if (name := export_name(export)) in ENGINES:
            yield from engine(name).files(recipe, export, stems, of_no_engine)
    yield OutputNames(manifest_name(recipe.name), "", "manifest", is_certain=True)


def expected_outputs(recipe: Recipe) -> Iterator[tuple[str, Role]]:
    """Yield the name and role of each output that a build of ``recipe`` will certainly write.

    The number of pages, the names that users' templates give, and which animations have flakes are
    known only once the frames are.
    """
    yield from ((file.first, file.role) for file in files(recipe) if file.is_certain)


def unexpected(recipe: Recipe, outputs: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yield the names of those ``outputs`` (name, role) that no build of ``recipe`` writes."""
    known = list(files(recipe))
    for file, role in outputs:
        is_known = any(names.role == role and names.has(file) for names in known)
        is_known = is_known or (role == "template" and _is_rendered(recipe, file))
        if not is_known or "/" in file:
            yield file


def possible(recipe: Recipe, names: Iterable[str]) -> Iterator[str]:
    """Yield those of ``names`` that a build of ``recipe`` may have written, whatever for."""
    known = list(files(recipe))
    for name in names:
        if any(file.has(name) for file in known) or _is_rendered(recipe, name):
            yield name


def _stem(name: str, scale: float) -> str:
    return name if scale == 1 else f"{name}@{scale:g}x"


def _sheet_files(recipe: Recipe, stems: list[str]) -> Iterator[OutputNames]:
    """Yield the pages of each scale, the maps beside them, and the files that describe them."""
    choices = recipe.texture_choices
    # Without a choice, formats of pages of fewer channels, which it does not name, are certain too.
    is_one, all_have = len(choices) == 1, set[str](choices[0]).intersection(*choices)
    for stem in stems:
        for ending, role, channels in _images(recipe):
            yield OutputNames(stem, ending, role, "page", is_certain=True)
            for format_ in formats_for(recipe.atlas.gpu, channels):
                texture = texture_file(ending, format_)
                yield OutputNames(stem, texture, "texture", "page", is_one or format_ in all_have)
        for export in map(export_name, recipe.exports):
            if export in EXPORTS:
                row = EXPORTS[export]
                of_each: OfEach = "page" if row.of_each_page else ""
                yield OutputNames(stem, row.ending, "atlas", of_each, is_certain=True)


def _images(recipe: Recipe) -> Iterator[tuple[str, Role, Channels]]:
    """Yield what follows a sheet's name in those of its page and of the maps beside it, each with
    its role and the number of channels that clients read."""
    atlas = recipe.atlas
    yield f".{atlas.format}", "page", page_channels(atlas.pixels)
    for kind in kinds_in(recipe.maps):
        yield kind.ending(atlas.format), "map", kind.channels


def _animation_files(recipe: Recipe) -> Iterator[OutputNames]:
    """Yield the tracks, the light and the movies of each animation."""
    is_one = recipe.views.count == recipe.variants == 1 and not (
        recipe.atlas.members or recipe.changes_in_game or recipe.composite.listed_ramps
    )
    is_known = is_one and recipe.flakes != "none"
    for track in recipe.tracks:
        if track == "light":
            yield OutputNames(recipe.name, light_file(""), "light", "animation")
        elif recipe.may_have_flakes:
            ending = TRACKS[track].ending
            yield OutputNames(recipe.name, ending, "tracks", "animation", is_known)
    for movie in recipe.movies:
        yield OutputNames(recipe.name, MOVIES[movie].ending, "movie", "animation", is_known)


def _is_rendered(recipe: Recipe, file: str) -> bool:
    """Return whether a template of the user's may write ``file``, a plain name."""
    templates = (export for export in recipe.exports if isinstance(export, TemplateExport))
    return any(_fits_template(export.to, file) for export in templates)


_PROGRAMS = (
    ".aar", ".asmdef", ".asmref", ".bat", ".bundle", ".cmd", ".com", ".cpp", ".cs", ".dll",
    ".dylib", ".exe", ".gd", ".gdextension", ".gdns", ".jar", ".java", ".js", ".jslib", ".lua",
    ".mjs", ".mm", ".ps1", ".py", ".res", ".rsp", ".scn", ".sh", ".so", ".tres", ".ts", ".tscn",
    ".vbs", ".wasm",
)  # fmt: skip
"""Endings of what an engine's editor compiles or loads as code as soon as it finds it in a project
(scenes and resources of Godot hold scripts), or a system runs."""

_FILLED_IN = re.compile(
    r"""\s*\{%.*%\}\s* | \s*\{\{(?:[^'"]|'[^']*'|"[^"]*")*?\}\}\s* | \{\#.*?\#\}""",
    re.DOTALL | re.VERBOSE,
)
"""What Jinja replaces in a name: from the first statement to the last, and expressions."""


def _fits_template(to: str, file: str) -> bool:
    """Return whether ``to``, the name of a template's file, may become ``file``."""
    if not fnmatchcase(file, "*".join(map(escape, _FILLED_IN.split(to)))):
        return False
    ending = PurePath(file).suffix.lower()
    return ending not in _PROGRAMS or to.lower().endswith(ending)
