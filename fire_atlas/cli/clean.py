"""``fire-atlas clean``."""

from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

from fire_atlas.cli.build import folder_of
from fire_atlas.cli.failure import Failures
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.manifest import manifest_name, read_manifest
from fire_atlas.outputs.ownership import stale_outputs
from fire_atlas.outputs.staging import explained
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.tree import RecipeTree, read_without_members


def run(args: Namespace) -> int:
    """Remove what builds of the recipes wrote, as far as it still is what they wrote."""
    failures = Failures(args.verbose > 1)
    with failures.caught():
        for path in find_recipes(args.recipes):
            with failures.caught():
                tree = read_without_members(path, args.overrides)
                for line in _cleaned(tree, folder_of(tree, args)):
                    if not args.quiet:
                        print(printable(f"{path}: {line}"))
    return failures.worst_code


def _cleaned(tree: RecipeTree, out: Path) -> Iterator[str]:
    """Remove the outputs of a recipe in ``out``, its manifest last; yield what was done."""
    listed = out / manifest_name(tree.name)
    if not listed.is_file():
        yield f"nothing to remove: there is no {listed}"
        return
    manifest = read_manifest(out, tree.name)
    if manifest is None:
        raise OutputError(
            f"{listed}: does not say soundly what was written here, so nothing was removed; build "
            f"the recipe again, or remove its files by hand"
        )
    going = [path for path in stale_outputs(out, tree.name, ()) if not path.is_symlink()]
    for path in (*going, listed):
        with explained(path):
            path.unlink()
        yield f"removed {path}"
    for path in (out / output.name for output in manifest.outputs):
        if path.exists() or path.is_symlink():
            yield f"kept {path}: it is not as the build wrote it"
