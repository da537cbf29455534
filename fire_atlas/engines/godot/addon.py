"""The add-on for Godot's editor: the files of ``addons/fire_atlas`` in a project.

Its templates, in ``templates/godot_addon``, are written for Godot 3 and 4 at once; a template is
rendered for the version of the project. All other files there are copied.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, TypeAlias

from fire_atlas import __version__
from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import MIB, absolute, read_file
from fire_atlas.core.output_file import OutputFile
from fire_atlas.core.shipped import shipped
from fire_atlas.formats.templates.jinja import rendered

ADDON_NAME = "fire_atlas"
"""Name of the add-on's folder, and file stem of its manifest."""

Version: TypeAlias = Literal[3, 4]
"""Major version of Godot."""

_FILES: dict[str, tuple[Version, ...]] = {
    "plugin.cfg.j2": (3, 4),
    "plugin.gd.j2": (3, 4),
    "builder.gd.j2": (3, 4),
    "exporter.gd.j2": (3, 4),
    "files.gd.j2": (3, 4),
    "importer.gd.j2": (3, 4),
    "inputs.gd.j2": (3, 4),
    "program.gd.j2": (3, 4),
    "fire_atlas_2d.gd": (4,),
    "fire_atlas_2d.svg": (4,),
    "fire_atlas_3d.gd": (4,),
    "fire_atlas_3d.svg": (4,),
    "fire_parts.gd": (4,),
}
"""Files in ``templates/godot_addon``, and the versions of Godot that get them."""

_CONFIG_VERSION = re.compile(rb"^config_version\s*=\s*(\d+)", re.MULTILINE)
_VERSIONS: dict[bytes, Version] = {b"4": 3, b"5": 4}
"""Versions of Godot by the ``config_version`` that their projects state."""

_MAX_DIGITS = 20
"""Maximum number of digits of a wrong ``config_version`` that an error shows."""


def addon_folder(project: Path) -> Path:
    """Return the folder of the add-on in a project."""
    return project / "addons" / ADDON_NAME


def addon_files(version: Version) -> Iterator[OutputFile]:
    """Yield the files of the add-on for a version of Godot."""
    for name, versions in _FILES.items():
        if version in versions:
            yield OutputFile(name.removesuffix(".j2"), "script", _content(name, version))


def _content(name: str, version: Version) -> bytes:
    file = f"godot_addon/{name}"
    if name.endswith(".j2"):
        return rendered(file, version=version, tool_version=__version__).encode()
    return (shipped("templates") / file).read_bytes()


def version_of_project(project: Path) -> Version:
    """Return the version of Godot that the project in a folder is for.

    Raises:
        OutputError: There is no project, or it is for another version.
    """
    path = project / "project.godot"
    try:
        stated = _CONFIG_VERSION.search(read_file(path, MIB))
    except OSError as error:
        raise OutputError(_no_project(project, error)) from error
    version = _VERSIONS.get(stated[1]) if stated else None
    if version is None:
        found = (
            f"config_version={stated[1][:_MAX_DIGITS].decode()}" if stated else "no config_version"
        )
        raise OutputError(
            f"{path}: states {found}; the add-on is for projects of Godot 3.1 and later, which "
            f"state 4, and of Godot 4, which state 5: open the project in one of them first"
        )
    return version


def _no_project(project: Path, error: OSError) -> str:
    """Return advice for a folder in which no project can be read."""
    path, folder = project / "project.godot", absolute(project)
    if isinstance(error, PermissionError):
        return f"{path}: cannot be read ({error.strerror}); change its permissions"
    if not isinstance(error, FileNotFoundError | NotADirectoryError):
        return f"{path}: cannot be read ({error.strerror}); name the folder of a Godot project"
    above = [each for each in folder.parents if (each / path.name).is_file()]
    near = f"did you mean fire-atlas plugin godot {above[0]}?" if above else "name its folder"
    return f"{path}: there is no such file, so {folder} is no Godot project; {near}"
