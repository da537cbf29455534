"""The command ``check``: validate recipes, and examine their inputs without decoding a frame."""

from argparse import Namespace
from pathlib import Path

from fire_atlas.cli.failure import Failures
from fire_atlas.cli.progress import BuildView, print_failed, view_for
from fire_atlas.cli.text import printable
from fire_atlas.outputs.folder import recover_default
from fire_atlas.pipeline.input.check import load_checked
from fire_atlas.recipe.find import find_recipes
from fire_atlas.recipe.load import resolved_yaml
from fire_atlas.recipe.tree import read_tree


def run(args: Namespace) -> int:
    """Check every recipe and that its inputs suit it; return the highest exit code."""
    view = view_for(False, args.quiet, args.verbose > 0)
    failed = dict[Path, str]()
    failures = Failures(args.verbose > 1, lambda message: failed.update({path: message}))
    path = Path()
    with failures.caught():
        paths = find_recipes(args.recipes)
        for path in paths:
            view.begin(path)
            with failures.caught():
                _check(path, args, view)
        if len(paths) > 1 and not (args.quiet or args.resolved):
            numbers = {"ok": len(paths) - len(failed), "failed": len(failed)}
            parts = ", ".join(f"{number} {what}" for what, number in numbers.items() if number)
            print(printable(f"{len(paths)} recipes: {parts}"))
            print_failed(failed)
    return failures.worst_code


def _check(path: Path, args: Namespace, view: BuildView) -> None:
    tree = read_tree(path, args.overrides)
    recover_default(path, tree.name, view.note)
    loaded = load_checked(tree)

    from fire_atlas.pipeline.examine import examine_alone  # reads headers, so it imports numpy

    for text in examine_alone(loaded):
        view.note(text)
    if args.resolved:
        for line in resolved_yaml(loaded).removesuffix("\n").split("\n"):
            print(printable(line))
    elif not args.quiet:
        print(printable(f"{path}: ok"))
