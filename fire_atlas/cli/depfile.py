"""Write depfiles: the files that outputs depend on, as rules for make and ninja.

Both support these escapes: a backslash before a space, ``#`` or ``:``, and ``$$``. Names that would
need others are refused, because make would reject the whole file. Some versions of ninja do not
support all of these; they start builds that are up to date.
"""

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import absolute
from fire_atlas.outputs.dependencies import dependencies_of
from fire_atlas.outputs.manifest import manifest_name
from fire_atlas.recipe.tree import RecipeTree

_UNWRITABLE = re.compile(r"[\t-\r;=|]|\\(?![\w.-])|[ :&]$|^~")

_IS_NO_TARGET = re.compile(r"%|^\.[A-Z_]+$")
"""Names that mean something else as targets: patterns, and orders to make such as ``.IGNORE``."""

_TARGET_END = f"{manifest_name('')}: \\".encode()
"""End of the first line of every depfile that this tool writes."""

_MAX_LINE_BYTES = 1 << 16


def write_depfile(
    path: Path, built: Sequence[tuple[RecipeTree, Path]], note: Callable[[str], None]
) -> None:
    """Write a rule for each recipe that was built into a folder.

    Its target is the manifest, which every build writes. It depends on recipes, inputs, templates,
    and the folders in which a new file would be a new frame. Each of these is also an empty target,
    so that make continues if one was removed; except names with ``%``, which as targets would be
    patterns, and names like ``.IGNORE``, which would be orders.

    ``note`` is called with a sentence if another process is waited for.

    Raises:
        OutputError: make cannot read one of the names, or ``path`` is another file.
    """
    from fire_atlas.outputs.staging import write_whole  # most builds write no depfile

    rules, known = [], dict[str, None]()
    for tree, out in built:
        needs = [_escaped(path) for path in dependencies_of(tree, out)]
        target = _escaped(out / manifest_name(tree.name))
        if "%" in target:
            raise OutputError(
                f"{out}: make takes the % for a pattern; choose another folder with -o"
            )
        rules.append(f"{target}: \\\n" + " \\\n".join(f"  {need}" for need in needs) + "\n")
        known |= dict.fromkeys(needs)
    targets = [f"\n{need}:\n" for need in known if not _IS_NO_TARGET.search(need)]
    refuse_overwriting(path)
    write_whole(path, os.fsencode("".join([*rules, *targets])), note)


def refuse_overwriting(path: Path) -> None:
    """Refuse to overwrite a file that is not an earlier depfile.

    Raises:
        OutputError: There is such a file.
    """
    if path.exists() and not _is_depfile(path):
        raise OutputError(
            f"{path}: is not a depfile, so --depfile does not overwrite it; choose another name, "
            f"like {path.stem}.d"
        )


def _is_depfile(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as file:
        first = file.readline(_MAX_LINE_BYTES).rstrip()
    return first.endswith(_TARGET_END) or path.stat().st_size == 0


def _escaped(path: Path) -> str:
    """Return a path as written in a depfile: relative to the current folder if it is inside."""
    here = Path.cwd()
    whole = absolute(path)
    text = (whole.relative_to(here) if whole.is_relative_to(here) else whole).as_posix()
    if _UNWRITABLE.search(text):
        raise OutputError(
            f"{text}: has a name that make cannot read (a tab, a line break, one of ; = |, or a "
            f"backslash before a character that is special); rename it, or do without --depfile"
        )
    return re.sub(r"([ #:])", r"\\\1", text).replace("$", "$$")
