"""The add-on for Godot's editor: the files of ``addons/fire_atlas`` in a project.

They lie in ``templates/godot_addon``, and are copied; only the version of the tool is filled in.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import MIB, absolute, read_file
from fire_atlas.core.output_file import OutputFile
from fire_atlas.core.shipped import shipped
from fire_atlas.core.version import __version__
from fire_atlas.formats.templates.jinja import rendered

ADDON_NAME = "fire_atlas"
"""Name of the add-on's folder, and file stem of its manifest."""

_FILES = (
    "plugin.cfg.j2", "plugin.gd", "builder.gd", "exporter.gd", "files.gd", "importer.gd",
    "inputs.gd", "program.gd", "fire_atlas_2d.gd", "fire_atlas_2d.svg", "fire_atlas_3d.gd",
    "fire_atlas_3d.svg", "fire_parts.gd",
)  # fmt: skip
"""Files in ``templates/godot_addon``."""

_CONFIG_VERSION = re.compile(rb"^config_version\s*=\s*(\d+)", re.MULTILINE)
_OF_GODOT_4 = b"5"
"""The ``config_version`` that projects of Godot 4 state."""

_MAX_DIGITS = 20
"""Maximum number of digits of a wrong ``config_version`` that an error shows."""


def addon_folder(project: Path) -> Path:
    """Return the folder of the add-on in a project."""
    return project / "addons" / ADDON_NAME


def addon_files() -> Iterator[OutputFile]:
    """Yield the files of the add-on."""
    for name in _FILES:
        yield OutputFile(name.removesuffix(".j2"), "script", _content(name))


def _content(name: str) -> bytes:
    file = f"godot_addon/{name}"
    if name.endswith(".j2"):
        return rendered(file, tool_version=__version__).encode()
    return (shipped("templates") / file).read_bytes()


def require_project(project: Path) -> None:
    """Raise ``OutputError`` unless there is a project of Godot 4 in a folder."""
    path = project / "project.godot"
    try:
        stated = _CONFIG_VERSION.search(read_file(path, MIB))
    except OSError as error:
        raise OutputError(_no_project(project, error)) from error
    if stated is None or stated[1] != _OF_GODOT_4:
        found = (
            f"config_version={stated[1][:_MAX_DIGITS].decode()}" if stated else "no config_version"
        )
        raise OutputError(
            f"{path}: states {found}; the add-on is for projects of Godot 4, which state 5: open "
            f"the project in Godot 4 first"
        )


def _no_project(project: Path, error: OSError) -> str:
    """Return advice for a folder in which no project can be read."""
    path, folder = project / "project.godot", absolute(project)
    if isinstance(error, PermissionError):
        return f"{path}: cannot be read ({error.strerror}); change its permissions"
    if not isinstance(error, FileNotFoundError | NotADirectoryError):
        return f"{path}: cannot be read ({error.strerror}); name the folder of a Godot project"
    above = [parent for parent in folder.parents if (parent / path.name).is_file()]
    near = f"did you mean fire-atlas plugin godot {above[0]}?" if above else "name its folder"
    return f"{path}: there is no such file, so {folder} is no Godot project; {near}"
