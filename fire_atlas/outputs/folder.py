"""Folders for outputs: the default one beside a recipe, and temporary ones."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import gettempdir

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import real
from fire_atlas.core.interruption import if_interrupted
from fire_atlas.outputs.disk import readable_errors
from fire_atlas.outputs.recovery import recover


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
    """Yield a new temporary folder; it is removed at the end, also after an error or a signal."""
    folder = Path(gettempdir()) / f"fire-atlas-{os.urandom(16).hex()}"
    remove = partial(shutil.rmtree, folder, ignore_errors=True)
    with if_interrupted(remove):
        try:
            with readable_errors(folder):
                folder.mkdir(mode=0o700)
            yield folder
        finally:
            remove()
