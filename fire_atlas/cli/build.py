"""The command ``build``: build recipes that are not up to date."""

from argparse import Namespace
from collections.abc import Container, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fire_atlas.cli.build_one import build_recipe, folder_of
from fire_atlas.cli.depfile import refuse_overwriting, write_depfile
from fire_atlas.cli.failure import Failures
from fire_atlas.cli.plan import Plan, refuse_unbuilt, shard
from fire_atlas.cli.progress import BuildView, shows_interruption, view_for
from fire_atlas.core.errors import OutputError, RecipeError
from fire_atlas.outputs.freshness import refresh_time, why_other_bytes, why_stale
from fire_atlas.outputs.outcome import Outcome, fresh_outcome
from fire_atlas.outputs.recovery import recover, tidy
from fire_atlas.recipe.find import find_recipes, refuse_same_outputs
from fire_atlas.recipe.tree import RecipeTree, read_tree

if TYPE_CHECKING:
    from fire_atlas.cli.cluster import ClusterBuilder
    from fire_atlas.cli.processes import BuildProcesses


def run(args: Namespace) -> int:
    """Build every recipe, even if others fail; return the highest exit code."""
    several = len(args.recipes) > 1 or args.recipes[0].is_dir()
    view = view_for(args.json, args.quiet, args.verbose > 0, several)
    failures = Failures(args.verbose > 1, view.failed, args.fail_fast)
    with failures.caught(), shows_interruption(view):
        if args.depfile:
            refuse_overwriting(args.depfile)
        paths = find_recipes(args.recipes)
        if args.shard:
            paths = shard(paths, args.overrides, partial(folder_of, args=args), *args.shard)
        trees = read_recipes(paths, args, view, failures)
        plan = Plan.of(trees, partial(folder_of, args=args))
        if args.frozen or args.dry_run:
            _inspect_all(plan, args, view, failures)
        else:
            built = _build_all(plan, args, view, failures)
            view.finish(len(paths))
            if args.depfile:
                write_depfile(
                    args.depfile, [(tree, folder_of(tree, args)) for tree in built], view.note
                )
    return failures.worst_code


def read_recipes(
    paths: Sequence[Path], args: Namespace, view: BuildView, failures: Failures
) -> list[RecipeTree]:
    """Return the recipes that can be read and have a valid name.

    Raises:
        RecipeError: Two of them would write the same files.
    """
    trees = []
    for path in paths:
        view.begin(path)
        with failures.caught(path):
            tree = read_tree(path, args.overrides)
            _ = tree.name  # raises if it is invalid
            trees.append(tree)
    refuse_same_outputs(trees, partial(folder_of, args=args))
    return trees


def _build_all(
    plan: Plan, args: Namespace, view: BuildView, failures: Failures
) -> list[RecipeTree]:
    """Build the recipes that are stale; return those whose outputs are now up to date.

    Several are built in processes of their own. One is built here, with all threads.
    """
    fresh, stale = _sorted_by_freshness(plan, args, view, failures)
    if failures.must_stop or not stale:
        return fresh
    if len(stale) == 1 and not args.scheduler:
        view.begin(stale[0].path)
        with failures.caught():
            view.done(build_recipe(stale[0], args, view))
            fresh += stale
        return fresh

    from fire_atlas.cli.side_by_side import build_side_by_side

    view.plan(len(stale))
    with _builder(args, view) as builder:
        built = build_side_by_side(stale, plan, builder, view, failures)
    if args.scheduler:
        built = [tree for tree in built if _is_here(tree, args, view, failures)]
    return fresh + built


def _is_here(tree: RecipeTree, args: Namespace, view: BuildView, failures: Failures) -> bool:
    """Whether the outputs that a cluster's worker wrote are here, if need be from the cache."""
    out = folder_of(tree, args)
    view.begin(tree.path)
    with failures.caught():
        if (reason := why_stale(tree, out)) is None:
            return True
        from fire_atlas.cli.cached import cache_of

        if cache_of(args) is None:
            raise OutputError(
                f"{tree.path}: a worker has built it, but not into {out} as it is seen here "
                f"({reason}): name a folder that all machines share by -o, or a --cache"
            )
        build_recipe(tree, args, view)
        return True
    return False


def _builder(args: Namespace, view: BuildView) -> "BuildProcesses | ClusterBuilder":
    """Return what builds several recipes: processes of this machine, or a cluster."""
    if not args.scheduler:
        from fire_atlas.cli.processes import BuildProcesses

        return BuildProcesses(args)
    if args.jobs:
        raise RecipeError("--jobs: not with --scheduler, whose workers have threads of their own")
    try:
        from fire_atlas.cli.cluster import ClusterBuilder
    except ModuleNotFoundError as error:
        raise OutputError(
            f"--scheduler: needs Dask ({error.name} is not installed): "
            f"pip install 'fire-atlas[cluster]'"
        ) from error
    return ClusterBuilder(args.scheduler, args, view)


def _sorted_by_freshness(
    plan: Plan, args: Namespace, view: BuildView, failures: Failures
) -> tuple[list[RecipeTree], list[RecipeTree]]:
    """Return the recipes that are up to date and those that are stale."""
    fresh, stale = dict[Path, RecipeTree](), dict[Path, RecipeTree]()
    for tree in plan.trees:
        view.begin(tree.path)
        with failures.caught():
            tidy(folder_of(tree, args), tree.name, view.note)
            refuse_unbuilt(tree, plan, {*fresh, *stale})
            if args.force or _why_stale(tree, plan, stale, args) is not None:
                stale[tree.path] = tree
            else:
                refresh_time(tree, folder_of(tree, args))
                view.done(fresh_outcome(tree, folder_of(tree, args)))
                fresh[tree.path] = tree
    return list(fresh.values()), list(stale.values())


def _inspect_all(plan: Plan, args: Namespace, view: BuildView, failures: Failures) -> None:
    """Show of each recipe what would be done, or with ``--frozen`` that nothing would be."""
    stale = set[Path]()
    for tree in plan.trees:
        view.begin(tree.path)
        with failures.caught():
            recover(folder_of(tree, args), tree.name, view.note)
            reason = _why_built(tree, plan, stale, args)
            if reason is not None:
                stale.add(tree.path)
            if args.frozen:
                view.done(_confirm(tree, reason, args))
            else:
                view.planned(reason)


def _why_stale(tree: RecipeTree, plan: Plan, stale: Container[Path], args: Namespace) -> str | None:
    """Return why the outputs of a recipe are stale, or will be; None if they are up to date."""
    for other in plan.before[tree.path]:
        if other in stale:
            return f"it reads what {other} writes, which is built before"
    return why_stale(tree, folder_of(tree, args))


def _why_built(tree: RecipeTree, plan: Plan, stale: Container[Path], args: Namespace) -> str | None:
    """Return why a recipe would be built; None if it would not."""
    reason = _why_stale(tree, plan, stale, args)
    if reason is not None or args.force:
        from fire_atlas.pipeline.input.check import load_checked

        loaded = load_checked(tree)

        if not any(other in stale for other in plan.before[tree.path]):  # else inputs are to come
            from fire_atlas.pipeline.examine import examine_alone  # reads headers: imports numpy

            examine_alone(loaded, args.max_pixels)
    return reason or ("--force" if args.force else None)


def _confirm(tree: RecipeTree, reason: str | None, args: Namespace) -> Outcome:
    """Return the outcome for ``--frozen``: the recipe is up to date.

    Raises:
        OutputError: It would be built for a ``reason``, or its outputs were made on another class
            of CPU.
    """
    if reason is not None:
        raise OutputError(f"{tree.path}: would be rebuilt: {reason} (build it without --frozen)")
    reason = why_other_bytes(folder_of(tree, args), tree.name)
    if reason is not None:
        raise OutputError(
            f"{tree.path}: is up to date, but {reason}, which may round the last digits in another"
            " way; build and check it on CPUs of one class, or without --frozen"
        )
    return fresh_outcome(tree, folder_of(tree, args))
