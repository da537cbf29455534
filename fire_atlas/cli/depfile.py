"""What outputs depend on, in the words of make and ninja."""

import os
import re
from collections.abc import Sequence
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.dependencies import files_of, folders_of
from fire_atlas.outputs.manifest import manifest_name
from fire_atlas.recipe.tree import RecipeTree


def depfile(built: Sequence[tuple[RecipeTree, Path]]) -> bytes:
    """Return a rule for each recipe that was built into a folder.

    Its target is the manifest, which every build writes. It depends on recipes, inputs and
    templates, and on the folders in which another file would be another frame. Each of them also
    is a target of its own without a rule, so that make goes on where one was removed.
    """
    rules, known = [], dict[str, None]()
    for tree, out in built:
        needs = [_escaped(path) for path in (*files_of(tree), *_settled(folders_of(tree), out))]
        target = _escaped(out / manifest_name(tree.name))
        rules.append(f"{target}: \\\n" + " \\\n".join(f"  {need}" for need in needs) + "\n")
        known |= dict.fromkeys(needs)
    return "".join([*rules, *(f"\n{need}:\n" for need in known)]).encode()


def _settled(folders: Sequence[Path], out: Path) -> list[Path]:
    """Leave out folders that a build itself changes: it would never be up to date."""
    return [folder for folder in folders if folder not in (out.resolve(), out.resolve().parent)]


def _escaped(path: Path) -> str:
    """Return a path as a depfile spells it: relative to here where it lies below."""
    here = Path.cwd()
    whole = Path(os.path.abspath(path))  # noqa: PTH100 - links stay as they are named
    text = (whole.relative_to(here) if whole.is_relative_to(here) else whole).as_posix()
    if re.search(r"[\n\r\t]", text):
        raise OutputError(f"{text!r}: no depfile can name a file with a line break or a tab")
    return re.sub(r"([ #])", r"\\\1", text).replace("$", "$$")
