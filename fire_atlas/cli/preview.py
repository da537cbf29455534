"""The command ``preview``: make an HTML page that plays a result, or a picture of it."""

from argparse import Namespace
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path

from fire_atlas.api import sentences_on
from fire_atlas.cli.arguments import refuse_build_options
from fire_atlas.cli.progress import BuildView, view_for
from fire_atlas.cli.temporary_build import BuiltAtlas, temporary_build
from fire_atlas.cli.text import printable
from fire_atlas.formats.atlas.texture_packer import read_atlas
from fire_atlas.outputs.folder import default_folder, make_folder
from fire_atlas.outputs.staging import refuse_existing, write_whole
from fire_atlas.preview.kinds import as_played, color_of, is_preview, preview_of
from fire_atlas.recipe.tree import RecipeTree, as_draft, is_recipe, read_tree

_SUFFIX = {"page": ".html", "gif": ".gif", "webp": ".webp", "apng": ".png", "sheet": ".sheet.png"}


def run(args: Namespace) -> int:
    """Make the HTML page or picture of a recipe or of a built atlas."""
    background = color_of(args.background, args.kind, "--background")
    tree = _tree(args)
    target = args.out or _default_target(args, args.subject.stem if tree is None else tree.name)
    _refuse_taken(target, args)
    view = view_for(json_lines=False, quiet=args.quiet, verbose=False)
    view.begin(args.subject)
    with _atlas(tree, args, view) as built:
        atlas = as_played(read_atlas(built.path), args.kind)
        budget = sentences_on(atlas).budget if args.kind == "page" else None
        data = preview_of(atlas, args.kind, background, built.clip, built.field, budget)
    if args.out is None:
        make_folder(target.parent)
    _refuse_taken(target, args)  # it may have come meanwhile
    write_whole(target, data, view.note)
    if not args.quiet:
        count = len(atlas.frames)
        print(printable(f"{target}: {count} frame{'s' if count > 1 else ''}"))
    return 0


def _refuse_taken(target: Path, args: Namespace) -> None:
    """Raise if a file would be replaced that is no older preview, unless the user says so."""
    if not args.overwrite and not is_preview(target, args.kind):
        refuse_existing([target])


def _default_target(args: Namespace, name: str) -> Path:
    """Return the default path: in the folder of a recipe's outputs, or beside a built atlas."""
    folder = default_folder(args.subject) if is_recipe(args.subject) else args.subject.parent
    return Path(folder / f"{name}.preview{_SUFFIX[args.kind]}")


def _tree(args: Namespace) -> RecipeTree | None:
    """Return the recipe to build; None if the subject is an atlas."""
    if is_recipe(args.subject):
        tree = read_tree(args.subject, [*args.overrides, "exports=[json]"])
        if tree.value(("fit",)) in (None, "none"):  # a budget has no tracks
            tree = replace(tree, values={**tree.values, "tracks": ["json"]})
        return as_draft(tree)
    why = "needs a recipe; an atlas that is built stays as it is"
    refuse_build_options(args, {"--field": args.field}, why)
    return None


def _atlas(
    tree: RecipeTree | None, args: Namespace, view: BuildView
) -> AbstractContextManager[BuiltAtlas]:
    """Return a context that gives the atlas: the one named, or one built in a temporary folder."""
    if tree is None:
        return nullcontext(BuiltAtlas(args.subject))
    return temporary_build(tree, args, view)
