"""The package for Unity's editor and games, which ``fire-atlas plugin unity`` writes.

Its own scripts are in ``templates/unity_package``. The players of flakes and heat and the shaders
come from the templates of ``export``, so that each is written in one place.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import absolute
from fire_atlas.core.output_file import OutputFile, Role
from fire_atlas.core.shipped import shipped
from fire_atlas.core.version import __version__
from fire_atlas.engines.unity.assets import (
    ComponentNames,
    assembly_text,
    heat_player_text,
    meta_text,
    player_text,
    shader_text,
)
from fire_atlas.engines.unity.names import META_ENDING, guid_of
from fire_atlas.formats.templates.jinja import rendered

PACKAGE_NAME = "com.fire-atlas.unity"
"""Name of the package, and of its folder in ``Packages``."""

PLAYER, FLAKES = "Runtime/FireAtlasPlayer.cs", "Runtime/FireAtlasFlakes.cs"
HEAT = "Runtime/FireAtlasHeat.cs"
"""Components that prefabs have."""

SPRITE_SHADER, FLAKES_SHADER = "Runtime/Sprite.shader", "Runtime/Flakes.shader"
HEAT_SHADER = "Runtime/Heat.shader"
"""Shaders that materials have."""

_SHADERS = {
    SPRITE_SHADER: "Fire Atlas/Sprite",
    FLAKES_SHADER: "Fire Atlas/Flakes",
    HEAT_SHADER: "Fire Atlas/Heat",
}
"""Name of each shader in Unity's menus."""

_FLAKES_NAMES = ComponentNames(
    class_name="FireAtlasFlakes",
    namespace="FireAtlas",
    heading="Plays the flakes of a fire. Written by fire-atlas plugin unity.",
    name="a fire",
    menu="Fire Atlas/Fire Atlas Flakes",
    mesh="Fire Atlas flakes",
)

_HEAT_NAMES = ComponentNames(
    class_name="FireAtlasHeat",
    namespace="FireAtlas",
    heading="Plays the heat of a fire. Written by fire-atlas plugin unity.",
    name="a fire",
    menu="Fire Atlas/Fire Atlas Heat",
    mesh="Fire Atlas heat",
)

_COPIED = (
    "README.md",
    PLAYER,
    "Runtime/LightTrack.cs",
    "Editor/RecipeBuild.cs",
    "Editor/RecipeImport.cs",
    "Editor/RecipeMenu.cs",
    "Editor/RecipePreferences.cs",
    "Editor/RecipeProgram.cs",
)
"""Files that are in ``templates/unity_package``, without their folder."""


def package_guid(file: str) -> str:
    """Return the GUID of a file of the package, by its path in the package's folder."""
    return guid_of(PACKAGE_NAME, file)


def shader_template(file: str) -> str:
    """Return the template of a shader, by its path in the package; builds have the same one."""
    return f"{file.rpartition('/')[2].lower()}.j2"


def package_folder(project: Path) -> Path:
    """Return the folder of the package in a project.

    Raises:
        OutputError: The folder ``project`` is no Unity project.
    """
    if not _is_project(project):
        folder = absolute(project)
        above = next(filter(_is_project, folder.parents), None)
        near = f"did you mean fire-atlas plugin unity {above}?" if above else "name its folder"
        raise OutputError(
            f"{folder}: has no folders Assets and ProjectSettings, so it is no Unity "
            f"project; {near}"
        )
    return project / "Packages" / PACKAGE_NAME


def package_files(manifest: str) -> Mapping[str, list[OutputFile]]:
    """Return the files of each folder of the package, by the folder's path in it.

    Args:
        manifest: File name of the manifest that is written into each folder. Unity imports it like
            any other file, so it has a ``.meta`` as well.
    """
    content = _content()
    folders = ["", *dict.fromkeys(path.rpartition("/")[0] for path in content if "/" in path)]
    return {
        folder: [
            *(_files_in(folder, content)),
            _meta(folder, manifest),
            *(_meta("", name) for name in folders if name and not folder),
        ]
        for folder in folders
    }


def _is_project(folder: Path) -> bool:
    return all((folder / name).is_dir() for name in ("Assets", "ProjectSettings"))


def _files_in(folder: str, content: Mapping[str, str]) -> Iterator[OutputFile]:
    """Yield the files of one folder, each with its ``.meta``."""
    for path, text in content.items():
        parent, _, file = path.rpartition("/")
        if parent == folder:
            role: Role = "script" if file.endswith(".cs") else "engine"
            yield OutputFile(file, role, text.encode())
            yield _meta(folder, file)


def _meta(folder: str, file: str) -> OutputFile:
    path = f"{folder}/{file}" if folder else file
    return OutputFile(file + META_ENDING, "import", meta_text(file, package_guid(path)).encode())


def _content() -> dict[str, str]:
    """Return the text of each file but ``.meta``, by its path in the package's folder."""
    templates = shipped("templates") / "unity_package"
    names = {path: path.rpartition("/")[2] for path in _COPIED}
    package = {"package": PACKAGE_NAME, "version": __version__}
    return {
        "package.json": rendered("unity_package/package.json.j2", (), **package),
        **{path: (templates / name).read_text(encoding="utf-8") for path, name in names.items()},
        "Runtime/FireAtlas.Runtime.asmdef": assembly_text("FireAtlas.Runtime"),
        "Editor/FireAtlas.Editor.asmdef": assembly_text("FireAtlas.Editor", editor=True),
        FLAKES: player_text(_FLAKES_NAMES, "a build's .flakes.bytes file"),
        HEAT: heat_player_text(_HEAT_NAMES),
        **{
            path: shader_text(shader_template(path), name, "a fire", universal=True)
            for path, name in _SHADERS.items()
        },
    }
