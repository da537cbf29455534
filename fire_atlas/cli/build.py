"""``fire-atlas build``."""

from argparse import Namespace
from pathlib import Path

from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import Outcome, Quiet, view_for
from fire_atlas.outputs.folder import default_folder
from fire_atlas.outputs.freshness import why_stale
from fire_atlas.recipe.find import find_recipes, refuse_same_outputs
from fire_atlas.recipe.tree import RecipeTree, read_tree


def run(args: Namespace) -> int:
    """Build every recipe named, whatever becomes of the others; return the worst exit code."""
    view = view_for(args.json, args.quiet, args.verbose > 0)
    failures = Failures(args.verbose > 1, view.failed)
    with failures.caught():
        trees = read_recipes(args, view, failures)
        built = [tree for tree in trees if _build(tree, args, view, failures)]
        if args.depfile and not args.dry_run:
            from fire_atlas.cli.depfile import depfile
            from fire_atlas.outputs.staging import write_whole

            write_whole(args.depfile, depfile([(tree, folder_of(tree, args)) for tree in built]))
    return failures.worst_code


def read_recipes(args: Namespace, view: Quiet, failures: Failures) -> list[RecipeTree]:
    """Return the recipes that can be read and whose outputs have a good name.

    Raises:
        RecipeError: Two of them would write the same files.
    """
    trees = []
    for path in find_recipes(args.recipes):
        view.begin(path)
        with failures.caught():
            tree = read_tree(path, args.overrides)
            _ = tree.name
            trees.append(tree)
    refuse_same_outputs(trees, lambda recipe: args.out or default_folder(recipe))
    return trees


def folder_of(tree: RecipeTree, args: Namespace) -> Path:
    """Return where the outputs of a recipe go."""
    return args.out or default_folder(tree.path)


def _build(tree: RecipeTree, args: Namespace, view: Quiet, failures: Failures) -> bool:
    """Build one recipe, or say what would be done; return whether that went well."""
    view.begin(tree.path)
    with failures.caught():
        if args.dry_run:
            view.planned(_plan(tree, args))
        else:
            view.done(build_recipe(tree, args, view))
        return True
    return False


def _plan(tree: RecipeTree, args: Namespace) -> str | None:
    """Say why a recipe would be built; None if it would not."""
    reason = why_stale(tree, folder_of(tree, args))
    if reason is not None or args.force:
        from fire_atlas.pipeline.check import load_checked

        load_checked(tree)  # a build would report what is wrong in it as well
    return reason or ("--force" if args.force else None)


def build_recipe(tree: RecipeTree, args: Namespace, view: Quiet) -> Outcome:
    """Build one recipe, or find that there is nothing to do before anything heavy is imported."""
    out = folder_of(tree, args)
    if not args.force and why_stale(tree, out) is None:
        return Outcome(fresh=True)

    from fire_atlas.core.workers import default_jobs
    from fire_atlas.pipeline.build import build
    from fire_atlas.pipeline.check import load_checked

    report = build(load_checked(tree), out, args.jobs or default_jobs(), view, args.most_pixels)
    return Outcome(list(report.files), report.timings, report.statistics)
