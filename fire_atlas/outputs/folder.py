"""Folders for outputs: the default one beside a recipe, and temporary ones."""

import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import gettempdir

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import real
from fire_atlas.core.interruption import if_interrupted
from fire_atlas.outputs.disk import readable_errors
from fire_atlas.outputs.locks import locked, locked_if_free
from fire_atlas.outputs.recovery import recover

_TEMPORARY = "fire-atlas-"
_TEMPORARY_OR_LOCK = re.compile(rf"\.?({_TEMPORARY}[0-9a-f]{{32}})(?:\.lock)?")
"""Names of temporary folders and of their locks."""


def default_folder(recipe: Path) -> Path:
    """Return the folder for the outputs of ``recipe`` without ``-o``: ``build`` beside it.

    Raises:
        OutputError: It is a link that leads out of the recipe's folder. A recipe from a stranger
            must not choose which of the user's folders is written to.
    """
    folder = recipe.parent / "build"
    refuse_leading_out(
        folder,
        recipe.parent,
        "the recipe's folder; if you want the outputs there, say so with -o",
    )
    return folder


def refuse_leading_out(folder: Path, owner: Path, advice: str) -> None:
    """Refuse a folder that a link takes out of ``owner``, which may come from a stranger.

    Args:
        folder: Inside of ``owner`` by its name.
        owner: The folder that it must stay in.
        advice: Ends the error: what ``owner`` is, and what to do.

    Raises:
        OutputError: It leads out, or in a circle.
    """
    target = real(folder)
    if target.is_symlink():
        raise OutputError(f"{folder}: is a link that leads in a circle; remove it")
    if not target.is_relative_to(real(owner)):
        raise OutputError(f"{folder}: is a link to {target}, outside {advice}")


def recover_default(recipe: Path, name: str, note: Callable[[str], None]) -> None:
    """Undo the unfinished commit of a killed build in the default folder of ``recipe``."""
    try:
        out = default_folder(recipe)
    except OutputError:
        return  # a link out of the recipe's folder: no build without -o has written there
    recover(out, name, note)


def make_folder(folder: Path) -> None:
    """Make a folder and its parents if they do not exist.

    Raises:
        OutputError: It cannot be made.
    """
    with readable_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield a new temporary folder; it is removed at the end, also after an error or a signal.

    Those of processes that were killed are removed first: nobody holds their locks.

    Raises:
        OutputError: It cannot be made.
    """
    parent = Path(gettempdir())
    _remove_left_behind(parent)
    folder = parent / f"{_TEMPORARY}{os.urandom(16).hex()}"
    remove = partial(shutil.rmtree, folder, ignore_errors=True)
    with ExitStack() as stack:
        with readable_errors(folder):
            stack.enter_context(locked(_lock_of(folder), lambda message: None))
            stack.enter_context(if_interrupted(remove))
            stack.callback(remove)
            folder.mkdir(mode=0o700)
        yield folder


def _remove_left_behind(parent: Path) -> None:
    """Remove the temporary folders in ``parent`` of this user's processes that were killed."""
    with suppress(OSError):  # it cannot be listed, or another process removes them too
        for path in parent.iterdir():
            if (found := _TEMPORARY_OR_LOCK.fullmatch(path.name)) and _is_own(path):
                folder = parent / found[1]
                with locked_if_free(_lock_of(folder)) as is_free:
                    if is_free:
                        shutil.rmtree(folder, ignore_errors=True)


def _lock_of(temporary: Path) -> Path:
    return temporary.with_name(f".{temporary.name}.lock")


def _is_own(path: Path) -> bool:
    """Return whether a path belongs to this user: others may write into the same folder."""
    return os.name == "nt" or path.lstat().st_uid == os.getuid()
