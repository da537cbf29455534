"""``fire-atlas watch``."""

import sys
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from stat import S_ISDIR
from typing import TypeAlias

from fire_atlas.cli.build import build_recipe, folder_of, read_recipes
from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import BuildView, shows_interruption, view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import SourceError
from fire_atlas.outputs.dependencies import files_of, folders_of, recipe_files
from fire_atlas.outputs.freshness import why_stale
from fire_atlas.outputs.recovery import tidy
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.tree import RecipeTree, read_tree
from fire_atlas.sources.listing import STILLS

_POLL_MILLISECONDS = 500
"""Interval at which Python handles signals while it waits for changes."""

_ENDINGS = {*STILLS, ".yaml", ".yml"}
"""Endings of files that are a frame or a recipe if they are in a watched folder."""


_FolderId: TypeAlias = tuple[int, int]
"""Device and inode of a folder."""


@dataclass(slots=True)
class _Watched:
    """The files and folders to watch; all paths are absolute.

    Attributes:
        files: Files that builds read.
        folders: Folders in which a new frame, recipe or folder changes a build.
        outs: Folders that builds write into.
    """

    files: set[Path] = field(default_factory=set)
    folders: set[Path] = field(default_factory=set)
    outs: set[Path] = field(default_factory=set)

    def concerns(self, path: Path) -> bool:
        """Return whether a change of ``path`` may change a build; hidden files are temporary."""
        if path in self.files:
            return True
        if path.name.startswith(".") or path.parent not in self.folders:
            return False
        own = path in self.outs or path.parent in self.outs
        return not own and (path.suffix.lower() in _ENDINGS or path.is_dir())

    @property
    def roots(self) -> dict[Path, _FolderId | None]:
        """The folders to watch, with their identity, or None if they do not exist.

        Those of files as well, because editors replace files rather than write into them.
        """
        folders = {*self.folders, *(path.parent for path in self.files)}
        return {folder: _folder_id(folder) for folder in sorted(folders)}


def run(args: Namespace) -> int:
    """Build the recipes, and again whenever they change, until interrupted.

    Failures are reported; the build is tried again at the next change.
    """
    for path in find_recipes(args.recipes):
        if not path.exists():
            read_tree(path)  # raises the error
    view = view_for(False, args.quiet, args.verbose > 0)
    with shows_interruption(view):
        watched = _pass(args, view, _Watched())
        while True:
            if not args.quiet:
                count = len(watched.files)
                print(printable(f"watching {count} files; Ctrl-C ends"), file=sys.stderr)
            for _ in _changes(watched):
                now = _pass(args, view, watched)
                if now != watched:
                    watched = now
                    break


def _changes(watched: _Watched) -> Iterator[None]:
    """Yield once when watching has begun, and then for every relevant change.

    Ends when a folder was replaced or removed, because the system continues to watch the one that
    was there, wherever it was moved.
    """
    from watchfiles import Change, watch

    roots = watched.roots
    removed = {(Change.deleted, str(root)) for root in roots}
    batches = watch(
        *(root for root, identity in roots.items() if identity),
        watch_filter=lambda *change: change in removed or watched.concerns(Path(change[1])),
        rust_timeout=_POLL_MILLISECONDS,
        yield_on_timeout=True,
        recursive=False,
    )
    next(batches)
    yield
    for changes in batches:
        if watched.roots != roots or not removed.isdisjoint(changes):
            return
        if changes:
            yield


def _folder_id(folder: Path) -> _FolderId | None:
    try:
        status = folder.stat()
    except OSError:
        return None
    return (status.st_dev, status.st_ino) if S_ISDIR(status.st_mode) else None


def _pass(args: Namespace, view: BuildView, before: _Watched) -> _Watched:
    """Build what is not up to date, and return what to watch from now on."""
    failures = Failures(args.verbose > 1, view.failed)
    named = [path.resolve() for path in args.recipes]
    watched = _Watched(
        {path for path in named if not path.is_dir()}, {path for path in named if path.is_dir()}
    )
    with failures.caught():
        for tree in read_recipes(args, view, failures):
            view.begin(tree.path)
            with failures.caught():
                _add_inputs(tree, watched)
                watched.outs.add(folder_of(tree, args).resolve())
                tidy(folder_of(tree, args), tree.name, view.note)
                if why_stale(tree, folder_of(tree, args)) is not None:
                    view.done(build_recipe(tree, args, view))
    if failures.worst_code:  # the file to be mended may be one that was watched before
        watched.files |= before.files
        watched.folders |= {*before.folders, *(path.parent for path in watched.files)}
    sys.stdout.flush()
    return watched


def _add_inputs(tree: RecipeTree, watched: _Watched) -> None:
    """Add what a build of ``tree`` reads, as far as it exists."""
    watched.files |= {path.resolve() for path in recipe_files(tree)}
    watched.folders |= {folder.resolve() for folder in folders_of(tree)}
    try:
        watched.files |= {path.resolve() for path in files_of(tree)}
    except SourceError:
        return  # the build reports it
