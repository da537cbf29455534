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

_PATIENCE = 500
"""Milliseconds between two looks whether anyone interrupts."""

_ENDINGS = {*STILLS, ".yaml", ".yml"}
"""Of files that are a frame or a recipe as soon as they lie in the right folder."""


_Identity: TypeAlias = tuple[int, int]
"""Device and inode of a folder."""


@dataclass(slots=True)
class _Watched:
    """What to look at.

    Attributes:
        files: Those whose change matters. Absolute, as are all.
        folders: Those in which a new frame, recipe or folder matters.
        outs: Those that builds write into.
    """

    files: set[Path] = field(default_factory=set)
    folders: set[Path] = field(default_factory=set)
    outs: set[Path] = field(default_factory=set)

    def concerns(self, path: Path) -> bool:
        """Whether a change of ``path`` matters. Hidden files are someone's temporary ones."""
        if path in self.files:
            return True
        if path.name.startswith(".") or path.parent not in self.folders:
            return False
        own = path in self.outs or path.parent in self.outs
        return not own and (path.suffix.lower() in _ENDINGS or path.is_dir())

    @property
    def roots(self) -> dict[Path, _Identity | None]:
        """The folders to look at: editors replace files, so it is their folders that change.

        Each with what tells it from another one of its name; None where there is none now.
        """
        folders = {*self.folders, *(path.parent for path in self.files)}
        return {folder: _identity(folder) for folder in sorted(folders)}


def run(args: Namespace) -> int:
    """Build the recipes, then again whatever changes, until someone interrupts.

    What fails is told, and tried again as soon as something changes.
    """
    for path in find_recipes(args.recipes):
        if not path.exists():
            read_tree(path)  # says so
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
    """Yield when the watch has begun, for what changed before, and then whenever it matters.

    It ends when a folder is another one than when it began, or is gone: the system goes on looking
    at the folder that was there, wherever that is now.
    """
    from watchfiles import Change, watch

    roots = watched.roots
    removed = {(Change.deleted, str(root)) for root in roots}
    looks = watch(
        *(root for root, identity in roots.items() if identity),
        watch_filter=lambda *change: change in removed or watched.concerns(Path(change[1])),
        rust_timeout=_PATIENCE,
        yield_on_timeout=True,
        recursive=False,
    )
    next(looks)
    yield
    for changes in looks:
        if watched.roots != roots or not removed.isdisjoint(changes):
            return
        if changes:
            yield


def _identity(folder: Path) -> _Identity | None:
    try:
        status = folder.stat()
    except OSError:
        return None
    return (status.st_dev, status.st_ino) if S_ISDIR(status.st_mode) else None


def _pass(args: Namespace, view: BuildView, before: _Watched) -> _Watched:
    """Build what is not up to date, and return what to look at from now on."""
    failures = Failures(args.verbose > 1, view.failed)
    named = [path.resolve() for path in args.recipes]
    watched = _Watched(
        {path for path in named if not path.is_dir()}, {path for path in named if path.is_dir()}
    )
    with failures.caught():
        for tree in read_recipes(args, view, failures):
            view.begin(tree.path)
            with failures.caught():
                _look_at(tree, watched)
                watched.outs.add(folder_of(tree, args).resolve())
                tidy(folder_of(tree, args), tree.name, view.note)
                if why_stale(tree, folder_of(tree, args)) is not None:
                    view.done(build_recipe(tree, args, view))
    if failures.worst_code:  # what was read before may be what has to be mended
        watched.files |= before.files
        watched.folders |= {*before.folders, *(path.parent for path in watched.files)}
    sys.stdout.flush()
    return watched


def _look_at(tree: RecipeTree, watched: _Watched) -> None:
    """Add what a build of ``tree`` reads, as far as it is there."""
    watched.files |= {path.resolve() for path in recipe_files(tree)}
    watched.folders |= {folder.resolve() for folder in folders_of(tree)}
    try:
        watched.files |= {path.resolve() for path in files_of(tree)}
    except SourceError:
        return  # the build says it better
