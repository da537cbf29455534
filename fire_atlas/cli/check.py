"""``fire-atlas check``."""

from argparse import Namespace

from fire_atlas.cli.failure import Failures
from fire_atlas.core.errors import SourceError
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.load import LoadedRecipe, load
from fire_atlas.recipe.resolved import resolved_yaml
from fire_atlas.sources.listing import list_inputs


def run(args: Namespace) -> int:
    """Validate every recipe named, and that its input is there; return the worst exit code."""
    failures = Failures(args.verbose > 1)
    with failures.caught():
        for path in find_recipes(args.recipes):
            with failures.caught():
                loaded = load(path, args.overrides)
                _find_inputs(loaded)
                if args.resolved:
                    print(resolved_yaml(loaded), end="")
                elif not args.quiet:
                    print(f"{path}: ok")
    return failures.worst_code


def _find_inputs(loaded: LoadedRecipe) -> None:
    try:
        list_inputs(loaded.recipe.source, loaded.source_path)
    except SourceError as error:
        key = ("source", "path")
        raise SourceError(f"{loaded.tree.origin(key).locate(key)}: {error}") from None
