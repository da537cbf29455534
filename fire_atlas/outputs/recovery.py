"""Clean up after killed builds: undo their unfinished commits, and remove their hidden files.

A commit moves a build's finished files into the output folder (see ``journal``). ``clear_staging``
cleans up after one build whose lock is held; ``clear_killed_builds`` after all builds into a folder
that do not run. Commands call ``recover``, which does so for one build and only if its commit was
cut off, before they read outputs, or ``tidy``, which cleans up the whole folder too.
"""

import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from fire_atlas.outputs.disk import readable_errors
from fire_atlas.outputs.journal import StagingFolder, undo_unfinished
from fire_atlas.outputs.locks import folder_lock, locked, locked_if_free, recipe_lock

_PREFIX, _LOCK, _STAGING = ".fire-atlas-", ".lock", ".staging"


def staging_folder(out: Path, name: str) -> StagingFolder:
    """Return the folder that holds the files of a build ``name`` into ``out`` until the commit."""
    return StagingFolder(out, out / f"{_PREFIX}{name}{_STAGING}")


def recover(out: Path, name: str, note: Callable[[str], None]) -> None:
    """If the build ``name`` was killed while it replaced files in ``out``, put the old ones back.

    Otherwise do nothing, which is quick. If the build is still running, it is waited for, and
    ``note`` is called with a sentence that says so.

    Raises:
        OutputError: The old files cannot be put back.
    """
    folder = staging_folder(out, name)
    if not folder.journal.exists():
        return
    with readable_errors(out), locked(recipe_lock(out, name), note):
        clear_staging(folder, note)


def tidy(out: Path, name: str, note: Callable[[str], None]) -> None:
    """Recover the build ``name``, and remove the hidden files of all killed builds into ``out``.

    Raises:
        OutputError: They cannot be removed.
    """
    recover(out, name, note)
    with readable_errors(out):
        clear_killed_builds(out, note)


def clear_killed_builds(out: Path, note: Callable[[str], None]) -> None:
    """Remove the hidden files of killed builds into ``out``; those of running ones stay."""
    for name in sorted(_names_of_builds(out)):
        with locked_if_free(recipe_lock(out, name)) as is_free:
            if is_free:
                clear_staging(staging_folder(out, name), note)
    if folder_lock(out).exists():
        with locked_if_free(folder_lock(out)):
            pass  # releasing a lock removes its file


def _names_of_builds(out: Path) -> set[str]:
    """Return the names of builds, running or killed, that have a staging folder or a lock."""
    if not out.is_dir():
        return set()
    hidden = (path for path in out.iterdir() if path.name.startswith(_PREFIX))
    return {path.stem.removeprefix(_PREFIX) for path in hidden if path.suffix in {_LOCK, _STAGING}}


def clear_staging(folder: StagingFolder, note: Callable[[str], None]) -> None:
    """Undo the unfinished commit of a killed build, if any, and remove its folder.

    The caller holds the lock of the build.
    """
    if folder.path.is_symlink() or not folder.path.is_dir():  # builds never make one
        folder.path.unlink(missing_ok=True)
    if folder.journal.exists():
        with locked(folder_lock(folder.out), note):
            undo_unfinished(folder)
    with suppress(FileNotFoundError):
        shutil.rmtree(folder.path)
