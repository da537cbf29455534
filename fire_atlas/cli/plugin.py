"""The command ``plugin``: copy the add-on of an engine into a project."""

from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.engines.godot.addon import (
    ADDON_NAME,
    addon_files,
    addon_folder,
    version_of_project,
)
from fire_atlas.outputs.addon import install
from fire_atlas.outputs.manifest import manifest_name


def run(args: Namespace) -> int:
    """Copy the add-on, or replace an older one; files of the user are never replaced."""
    project = Path(args.folder)
    view = view_for(False, args.quiet, False)
    view.begin(project)
    installed = _install_for_godot if args.engine == "godot" else _install_for_unity
    lines = installed(project, args.overwrite, view.note)
    if not args.quiet:
        for line in lines:
            print(printable(line))
    return 0


def _install_for_godot(
    project: Path, overwrite: bool, note: Callable[[str], None]
) -> tuple[str, ...]:
    """Write the add-on into a Godot project; return what to tell the user."""
    version = version_of_project(project)
    folder, files = addon_folder(project), list(addon_files(version))
    if not install(project, {folder: files}, ADDON_NAME, overwrite, note):
        return (f"{folder}: up to date",)
    return (
        f"wrote {len(files)} files for Godot {version} to {folder}",
        "next: enable Fire Atlas in the editor, in Project > Project Settings > Plugins",
    )


def _install_for_unity(
    project: Path, overwrite: bool, note: Callable[[str], None]
) -> tuple[str, ...]:
    """Write the package into a Unity project; return what to tell the user."""
    # Imported here because it needs numpy, which the add-on for Godot does not.
    from fire_atlas.engines.unity.package import PACKAGE_NAME, package_files, package_folder

    package = package_folder(project)
    files = package_files(manifest_name(PACKAGE_NAME))
    folders = {package / folder: each for folder, each in files.items()}
    if not install(project, folders, PACKAGE_NAME, overwrite, note):
        return (f"{package}: up to date",)
    return (
        f"wrote {sum(map(len, folders.values()))} files to {package}",
        "next: open the project in Unity 2021.3 or later; select a recipe in the Project window, "
        "then Assets > Fire Atlas > Build Selected Recipes",
    )
