"""The command ``clean``: remove what builds of recipes wrote."""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from fire_atlas.cli.build_one import folder_of
from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import FireAtlasError, OutputError
from fire_atlas.core.interruption import signals_wait
from fire_atlas.outputs.disk import readable_errors
from fire_atlas.outputs.locks import folder_lock, locked, recipe_lock
from fire_atlas.outputs.manifest import Manifest, manifest_name
from fire_atlas.outputs.ownership import FolderManifests, stale_outputs
from fire_atlas.outputs.recovery import tidy
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.tree import RecipeTree, read_without_members

_MAX_NAMES = 8
"""So many files are named in a message."""


def run(args: Namespace) -> int:
    """Remove those outputs of the recipes that nobody changed; return the highest exit code."""
    failures = Failures(args.verbose > 1)
    view = view_for(False, args.quiet, args.verbose > 0)
    with failures.caught():
        for path in find_recipes(args.recipes):
            with failures.caught():
                tree = read_without_members(path, args.overrides)
                view.begin(path)
                for line in _cleaned(tree, folder_of(tree, args), view.note):
                    if not args.quiet:
                        print(printable(f"{path}: {line}"))
    return failures.worst_code


def _cleaned(tree: RecipeTree, out: Path, note: Callable[[str], None]) -> Iterator[str]:
    """Remove the outputs of a recipe in ``out``, its manifest last; yield a line for each."""
    tidy(out, tree.name, note)
    listed = out / manifest_name(tree.name)
    if not listed.is_file():
        yield f"nothing to remove: there is no {listed}"
        return
    with (
        readable_errors(out),
        locked(recipe_lock(out, tree.name), note),
        locked(folder_lock(out), note),
    ):
        manifests = FolderManifests.read(out, tree.name)
        if manifests.own is None:
            raise OutputError(
                f"{listed}: is damaged and does not state what was written here, so nothing was "
                f"removed; build the recipe again, or remove its files by hand"
                f"{_possible_outputs(tree, out)}"
            )
        removed = [*(out / name for name in stale_outputs(manifests, ())), listed]
        _remove(removed)
        yield from (f"removed {path}" for path in removed)
        yield from _kept(manifests, manifests.own)


def _possible_outputs(tree: RecipeTree, out: Path) -> str:
    """Return a list of the files in ``out`` that are called like those of a recipe, as the end of a
    sentence; nothing if the recipe is invalid."""
    from fire_atlas.pipeline.files.expected import possible
    from fire_atlas.recipe.load import load_tree

    try:
        recipe = load_tree(tree).recipe
    except FireAtlasError:
        return ""
    names = sorted(possible(recipe, (path.name for path in out.iterdir())))
    more = f" and {len(names) - _MAX_NAMES} more" if len(names) > _MAX_NAMES else ""
    return f", which are called {', '.join(names[:_MAX_NAMES])}{more}"


def _remove(paths: Sequence[Path]) -> None:
    """Remove files, the manifest last, so that an interrupted ``clean`` can be run again."""
    with signals_wait():
        for path in paths:
            with readable_errors(path):
                path.unlink()


def _kept(manifests: FolderManifests, own: Manifest) -> Iterator[str]:
    """Yield a line for each output that was kept, with the reason."""
    for output in own.outputs:
        path = manifests.out / output.name
        if path.exists() or path.is_symlink():
            other = manifests.other_owner(output.name)
            wrote = f"the build of {other} wrote it too"
            yield f"kept {path}: {wrote if other else 'it was changed since it was built'}"
