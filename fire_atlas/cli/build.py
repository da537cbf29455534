"""``fire-atlas build``."""

from argparse import Namespace
from pathlib import Path

from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import Outcome, Quiet, view_for
from fire_atlas.manifest import default_folder, is_fresh
from fire_atlas.recipe.find import find_recipes, refuse_same_outputs
from fire_atlas.recipe.tree import RecipeTree, read_tree


def run(args: Namespace) -> int:
    """Build every recipe named, whatever becomes of the others; return the worst exit code."""
    view = view_for(args.json, args.quiet, args.verbose > 0)
    failures = Failures(args.verbose > 1, view.failed)
    with failures.caught():
        trees = _read(args, view, failures)
        refuse_same_outputs(trees, lambda recipe: _folder(recipe, args))
        for tree in trees:
            view.begin(tree.path)
            with failures.caught():
                view.done(_build(tree, args, view))
    return failures.worst_code


def _read(args: Namespace, view: Quiet, failures: Failures) -> list[RecipeTree]:
    """Return the recipes that can be read and whose outputs have a good name."""
    trees = []
    for path in find_recipes(args.recipes):
        view.begin(path)
        with failures.caught():
            tree = read_tree(path, args.overrides)
            _ = tree.name
            trees.append(tree)
    return trees


def _folder(recipe: Path, args: Namespace) -> Path:
    """Return where the outputs of ``recipe`` go."""
    return args.out or default_folder(recipe)


def _build(tree: RecipeTree, args: Namespace, view: Quiet) -> Outcome:
    """Build one recipe, or find that there is nothing to do before anything heavy is imported."""
    out = _folder(tree.path, args)
    if not args.force and is_fresh(tree, out):
        return Outcome(fresh=True)

    from fire_atlas.build import build
    from fire_atlas.core.workers import default_jobs
    from fire_atlas.recipe.load import load_tree

    report = build(load_tree(tree), out, args.jobs or default_jobs(), view)
    return Outcome(list(report.files), report.timings, report.statistics)
