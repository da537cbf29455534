"""The command ``watch``: rebuild when a recipe or one of its inputs changes."""

import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from stat import S_ISDIR
from typing import TypeAlias

from fire_atlas.cli.build import read_recipes
from fire_atlas.cli.build_one import build_recipe, folder_of
from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import BuildView, shows_interruption, view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import links_to, real
from fire_atlas.core.interruption import ends_by_interrupt
from fire_atlas.outputs.dependencies import files_of, folders_of, recipe_files
from fire_atlas.outputs.freshness import why_stale
from fire_atlas.outputs.outcome import fresh_outcome
from fire_atlas.outputs.recovery import tidy
from fire_atlas.recipe.document import RECIPE_ENDINGS
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.tree import RecipeTree, as_draft, named_files, read_tree
from fire_atlas.sources.listing import STILLS

_POLL_MILLISECONDS = 500
"""Python handles signals at this interval while it waits for changes."""

_ENDED = "\nwatch has ended; every build's outputs are whole\n"
"""Message at Ctrl-C, below the ^C that a terminal shows."""

_ENDINGS = {*STILLS, *RECIPE_ENDINGS}
"""Endings of the files in a watched folder that may be frames or recipes."""


_FolderId: TypeAlias = tuple[int, int]
"""Device and inode of a folder."""


@dataclass(slots=True)
class _Watched:
    """The files and folders to watch; all paths are absolute.

    Attributes:
        files: Files that builds read, and links that lead to what they read.
        folders: Folders in which a new frame, recipe or folder changes a build.
        outs: Folders that builds write into.
        failed: Why recipes could not be built, as it was printed.
    """

    files: set[Path] = field(default_factory=set)
    folders: set[Path] = field(default_factory=set)
    outs: set[Path] = field(default_factory=set)
    failed: dict[Path, str] = field(default_factory=dict, compare=False)

    def is_relevant(self, path: Path) -> bool:
        """Return whether a change of ``path`` may change a build; hidden files are temporary."""
        if path in self.files:
            return True
        if path.name.startswith(".") or path.parent not in self.folders:
            return False
        is_output = path in self.outs or path.parent in self.outs
        return not is_output and (path.suffix.lower() in _ENDINGS or path.is_dir())

    @property
    def roots(self) -> dict[Path, _FolderId | None]:
        """The folders to watch, with their identity, or None if they do not exist.

        Files are watched by their folders, because editors replace files instead of writing into
        them.
        """
        folders = {*self.folders, *(path.parent for path in self.files)}
        return {folder: _folder_id(folder) for folder in sorted(folders)}


def run(args: Namespace) -> int:
    """Build the recipes, and again whenever they change, until Ctrl-C, which is no error.

    Failures are reported; the build is tried again at the next change.
    """
    for path in find_recipes(args.recipes):
        if not path.exists():
            read_tree(path)  # raises the error
    view = view_for(False, args.quiet, args.verbose > 0)
    with shows_interruption(view), ends_by_interrupt("" if args.quiet else _ENDED):
        watched = _build_all(args, view, _Watched())
        while True:
            if not args.quiet:
                count = len(watched.files)
                print(printable(f"watching {count} files; Ctrl-C ends"), file=sys.stderr)
            for _ in _changes(watched):
                before, watched = watched, _build_all(args, view, watched)
                if watched != before:
                    break  # start watching the new set of files


def _changes(watched: _Watched) -> Iterator[None]:
    """Yield once when watching has begun, and then for every relevant change.

    Ends when a folder was replaced or removed, because the system would go on watching the old one
    under its new name. The caller then starts watching again.
    """
    from watchfiles import Change, watch

    roots = watched.roots
    removed = {(Change.deleted, str(root)) for root in roots}
    batches = watch(
        *(root for root, identity in roots.items() if identity),
        watch_filter=lambda *change: change in removed or watched.is_relevant(Path(change[1])),
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


def _build_all(args: Namespace, view: BuildView, before: _Watched) -> _Watched:
    """Build the recipes that are not up to date; return the files and folders to watch.

    Compressed textures are encoded as drafts, but what a build has encoded in full is up to date.
    """
    failures = Failures(args.verbose > 1, view.failed, known=before.failed)
    named = [real(path) for path in args.recipes]
    watched = _Watched(
        {path for path in named if not path.is_dir()}, {path for path in named if path.is_dir()}
    )
    watched.files |= {link for path in args.recipes for link in links_to(path)}
    with failures.caught():
        for tree in read_recipes(find_recipes(args.recipes), args, view, failures):
            view.begin(tree.path)
            with failures.caught(tree.path):
                _add_inputs(tree, watched)
                watched.outs.add(real(folder_of(tree, args)))
                out, draft = folder_of(tree, args), as_draft(tree)
                tidy(out, tree.name, view.note)
                if why_stale(tree, out) is not None and why_stale(draft, out) is not None:
                    view.done(build_recipe(draft, args, view))
                elif tree.path in before.failed:
                    view.done(fresh_outcome(tree, out))
    watched.failed = failures.of_recipes
    for path in before.failed.keys() - watched.failed.keys():
        view.begin(path)
        view.note("the mistake is mended")
    if failures.worst_code:  # watch the earlier files too: the user may fix one
        watched.files |= before.files
        watched.folders |= {*before.folders, *(path.parent for path in watched.files)}
    sys.stdout.flush()
    return watched


def _add_inputs(tree: RecipeTree, watched: _Watched) -> None:
    """Add the files and folders that a build of ``tree`` reads, as far as they exist."""
    read = [*recipe_files(tree), *folders_of(tree)]
    with suppress(SourceError):  # the build reports it
        read += files_of(tree)
    watched.folders |= {real(folder) for folder in folders_of(tree)}
    watched.files |= {real(path) for path in read} - watched.folders
    named = [
        recipe.named_at(key, str(recipe.value(key)))
        for recipe in (tree, *tree.members)
        for key in named_files(recipe)
    ]
    watched.files |= {link for path in (*read, *named) for link in links_to(path)}
