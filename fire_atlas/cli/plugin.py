"""The command ``plugin``: copy the add-on of an engine into a project."""

from argparse import Namespace
from pathlib import Path

from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.engines.engine import engine
from fire_atlas.outputs.addon import install
from fire_atlas.outputs.manifest import manifest_name


def run(args: Namespace) -> int:
    """Copy the add-on, or replace an older one; files of the user are never replaced."""
    project = Path(args.folder)
    view = view_for(False, args.quiet, False)
    view.begin(project)
    addon = engine(args.engine).addon(project, manifest_name)
    is_written = install(project, addon.files, addon.name, args.overwrite, view.note)
    if args.quiet:
        return 0
    if is_written:
        count = sum(map(len, addon.files.values()))
        print(printable(f"wrote {count} files for {addon.title} to {addon.folder}"))
        print(printable(f"next: {addon.next_step}"))
    else:
        print(printable(f"{addon.folder}: up to date"))
    return 0
