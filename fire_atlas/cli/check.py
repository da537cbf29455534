"""The command ``check``: validate recipes and look for their inputs."""

from argparse import Namespace

from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import view_for
from fire_atlas.cli.text import printable
from fire_atlas.core.errors import SourceError
from fire_atlas.outputs.dependencies import textures_of
from fire_atlas.outputs.folder import recover_default
from fire_atlas.pipeline.check import load_checked
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.load import LoadedRecipe, resolved_yaml
from fire_atlas.recipe.source import ClipInput
from fire_atlas.recipe.tree import read_tree
from fire_atlas.sources.listing import ALL_FRAMES, list_inputs


def run(args: Namespace) -> int:
    """Check every recipe and that its inputs exist; return the highest exit code."""
    failures = Failures(args.verbose > 1)
    view = view_for(False, args.quiet, args.verbose > 0)
    with failures.caught():
        for path in find_recipes(args.recipes):
            with failures.caught():
                tree = read_tree(path, args.overrides)
                view.begin(path)
                recover_default(path, tree.name, view.note)
                loaded = load_checked(tree)
                _find_inputs(loaded)
                if args.resolved:
                    print(resolved_yaml(loaded), end="")
                elif not args.quiet:
                    print(printable(f"{path}: ok"))
    return failures.worst_code


def _find_inputs(loaded: LoadedRecipe) -> None:
    for part in loaded.parts:
        _find_source(part)
    for path in loaded.templates.values():
        if not path.is_file():
            where = loaded.tree.origin(("exports",)).locate(("exports",))
            raise SourceError(f"{where}: there is no template {path}")


def _find_source(part: LoadedRecipe) -> None:
    source = part.recipe.source
    for key, path in part.source_files.items():
        try:
            list_inputs(source if isinstance(source, ClipInput) else ALL_FRAMES, path)
        except SourceError as error:
            raise SourceError(f"{part.tree.origin(key).locate(key)}: {error}") from None
    textures_of(part.tree)
