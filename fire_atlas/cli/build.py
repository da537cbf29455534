"""The command ``build``: build recipes that are not up to date."""

from argparse import Namespace
from pathlib import Path

from fire_atlas.cli.depfile import refuse_overwriting, write_depfile
from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import BuildView, Outcome, shows_interruption, view_for
from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.folder import default_folder
from fire_atlas.outputs.freshness import refresh_time, why_other_bytes, why_stale
from fire_atlas.outputs.recovery import recover, tidy
from fire_atlas.recipe.find import find_recipes, refuse_same_outputs
from fire_atlas.recipe.tree import RecipeTree, read_tree


def run(args: Namespace) -> int:
    """Build every recipe, even if others fail; return the highest exit code."""
    view = view_for(args.json, args.quiet, args.verbose > 0)
    failures = Failures(args.verbose > 1, view.failed)
    with failures.caught(), shows_interruption(view):
        if args.depfile:
            refuse_overwriting(args.depfile)
        trees = read_recipes(args, view, failures)
        built = [tree for tree in trees if _build(tree, args, view, failures)]
        if args.depfile and not (args.dry_run or args.frozen):
            write_depfile(
                args.depfile, [(tree, folder_of(tree, args)) for tree in built], view.note
            )
    return failures.worst_code


def read_recipes(args: Namespace, view: BuildView, failures: Failures) -> list[RecipeTree]:
    """Return the recipes that can be read and have a valid name.

    Raises:
        RecipeError: Two of them would write the same files.
    """
    trees = []
    for path in find_recipes(args.recipes):
        view.begin(path)
        with failures.caught():
            tree = read_tree(path, args.overrides)
            _ = tree.name  # raises if it is invalid
            trees.append(tree)
    refuse_same_outputs(trees, lambda recipe: args.out or default_folder(recipe))
    return trees


def folder_of(tree: RecipeTree, args: Namespace) -> Path:
    """Return the folder for the outputs of a recipe."""
    return args.out or default_folder(tree.path)


def _build(tree: RecipeTree, args: Namespace, view: BuildView, failures: Failures) -> bool:
    """Build one recipe, or show what would be done; return whether that succeeded."""
    view.begin(tree.path)
    with failures.caught():
        out = folder_of(tree, args)
        (recover if args.dry_run or args.frozen else tidy)(out, tree.name, view.note)
        if args.frozen:
            view.done(_confirm(tree, args))
        elif args.dry_run:
            view.planned(_plan(tree, args))
        else:
            view.done(build_recipe(tree, args, view))
        return True
    return False


def _plan(tree: RecipeTree, args: Namespace) -> str | None:
    """Return why a recipe would be built; None if it would not."""
    reason = why_stale(tree, folder_of(tree, args))
    if reason is not None or args.force:
        from fire_atlas.pipeline.check import load_checked

        load_checked(tree)  # raises the errors that a build would report
    return reason or ("--force" if args.force else None)


def _confirm(tree: RecipeTree, args: Namespace) -> Outcome:
    """Return the outcome for ``--frozen``: the recipe is up to date.

    Raises:
        OutputError: It is stale, or its outputs were made on another class of CPU.
    """
    reason = _plan(tree, args)
    if reason is not None:
        raise OutputError(f"{tree.path}: would be rebuilt: {reason} (build it without --frozen)")
    reason = why_other_bytes(folder_of(tree, args), tree.name)
    if reason is not None:
        raise OutputError(
            f"{tree.path}: is up to date, but {reason}, which may round the last digits in another"
            " way; build and check it on CPUs of one class, or without --frozen"
        )
    return Outcome(fresh=True)


def build_recipe(tree: RecipeTree, args: Namespace, view: BuildView) -> Outcome:
    """Build one recipe if it is not up to date; import heavy modules only then."""
    out = folder_of(tree, args)
    if not args.force and why_stale(tree, out) is None:
        refresh_time(tree, out)
        return Outcome(fresh=True)

    from fire_atlas.cli.cached import cache_of, restored
    from fire_atlas.pipeline.check import load_checked

    loaded, cache = load_checked(tree), cache_of(args)
    if cache and not args.force and (outcome := restored(loaded, cache, out, args, view)):
        return outcome

    from fire_atlas.pipeline.build import build
    from fire_atlas.pipeline.context import BuildOptions

    options = BuildOptions.of(args.jobs, args.max_pixels, args.overwrite, args.force)
    report = build(loaded, out, options, view)
    if report is None:
        return Outcome(fresh=True)
    if cache and cache.writes:
        view.cache(*cache.store(out, tree.name, report.merged, view.note))
    return Outcome(list(report.files), report.timings, report.statistics)
