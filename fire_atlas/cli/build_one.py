"""Build one recipe in this process, or take its outputs from the cache."""

from argparse import Namespace
from pathlib import Path

from fire_atlas.cli.progress import BuildView
from fire_atlas.outputs.folder import default_folder
from fire_atlas.outputs.outcome import Outcome, fresh_outcome
from fire_atlas.recipe.tree import RecipeTree


def folder_of(tree: RecipeTree, args: Namespace) -> Path:
    """Return the folder for the outputs of a recipe."""
    return args.out or default_folder(tree.path)


def build_recipe(tree: RecipeTree, args: Namespace, view: BuildView) -> Outcome:
    """Build a recipe that is not up to date; import heavy modules only if the cache lacks it."""
    from fire_atlas.cli.cached import cache_of, restored
    from fire_atlas.pipeline.input.check import load_checked

    loaded, cache, out = load_checked(tree), cache_of(args), folder_of(tree, args)
    if cache and not args.force and (outcome := restored(loaded, cache, out, args, view)):
        return outcome

    from fire_atlas.core.context import BuildOptions
    from fire_atlas.pipeline.build import build

    options = BuildOptions.of(args.jobs, args.max_pixels, args.overwrite, args.force)
    report = build(loaded, out, options, view)
    if report is None:
        return fresh_outcome(tree, out)
    if cache and cache.writes:
        view.cache(*cache.store(out, tree.name, report.merged, view.note))
    return Outcome(list(report.files), report.timings, report.statistics)
