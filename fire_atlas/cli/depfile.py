"""What outputs depend on, in the words of make and ninja.

They agree on little: a backslash before a space, ``#`` or ``:``, and ``$$``. Names that make cannot
be told so are refused, for it would not read the file at all. A few characters are unknown to some
versions of ninja; there, it starts builds that find that they are up to date.
"""

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.dependencies import files_of, folders_of
from fire_atlas.outputs.manifest import manifest_name
from fire_atlas.recipe.tree import RecipeTree

_UNTELLABLE = re.compile(r"[\t\n\r;=|]|\\(?![\w.-])|[ :&]$|^~")

_TARGET_END = f"{manifest_name('')}: \\".encode()
"""How the first line of every depfile ends."""

_LONGEST_LINE = 1 << 16


def write_depfile(
    path: Path, built: Sequence[tuple[RecipeTree, Path]], note: Callable[[str], None]
) -> None:
    """Write a rule for each recipe that was built into a folder.

    Its target is the manifest, which every build writes. It depends on recipes, inputs and
    templates, and on the folders in which another file would be another frame. Each of them also
    is a target of its own without a rule, so that make goes on where one was removed; but for names
    with ``%``, which only as targets would be patterns. ``note`` is called with a sentence if
    another process is waited for.

    Raises:
        OutputError: make cannot be told one of the names, or ``path`` holds something else.
    """
    from fire_atlas.outputs.staging import write_whole  # most builds do without

    rules, known = [], dict[str, None]()
    for tree, out in built:
        needs = [_escaped(path) for path in (*files_of(tree), *_settled(folders_of(tree), out))]
        target = _escaped(out / manifest_name(tree.name))
        if "%" in target:
            raise OutputError(
                f"{out}: make takes the % for a pattern; choose another folder with -o"
            )
        rules.append(f"{target}: \\\n" + " \\\n".join(f"  {need}" for need in needs) + "\n")
        known |= dict.fromkeys(needs)
    targets = [f"\n{need}:\n" for need in known if "%" not in need]
    refuse_overwriting(path)
    write_whole(path, os.fsencode("".join([*rules, *targets])), note)


def refuse_overwriting(path: Path) -> None:
    """Refuse to write a depfile over anything but an earlier one: an input, an output or a note.

    Raises:
        OutputError: Something else is there.
    """
    if path.exists() and not _is_depfile(path):
        raise OutputError(
            f"{path}: is no depfile, so --depfile does not write over it; choose another name, "
            f"like {path.stem}.d"
        )


def _is_depfile(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as file:
        first = file.readline(_LONGEST_LINE).rstrip()
    return not first or first.endswith(_TARGET_END)


def _settled(folders: Sequence[Path], out: Path) -> list[Path]:
    """Leave out folders that a build itself changes: it would never be up to date."""
    return [folder for folder in folders if folder not in (out.resolve(), out.resolve().parent)]


def _escaped(path: Path) -> str:
    """Return a path as a depfile spells it: relative to here where it lies below."""
    here = Path.cwd()
    whole = Path(os.path.abspath(path))  # noqa: PTH100 - links stay as they are named
    text = (whole.relative_to(here) if whole.is_relative_to(here) else whole).as_posix()
    if _UNTELLABLE.search(text):
        raise OutputError(
            f"{text}: has a name that make cannot be told (a tab, a line break, one of ; = |, or a "
            f"backslash before a character that is special); rename it, or do without --depfile"
        )
    return re.sub(r"([ #:])", r"\\\1", text).replace("$", "$$")
