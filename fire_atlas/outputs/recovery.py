"""What builds that died have left in an output folder is put right by whoever comes next."""

import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from fire_atlas.outputs.disk import explained
from fire_atlas.outputs.journal import StagingFolder, undo_unfinished
from fire_atlas.outputs.locks import folder_lock, locked, locked_if_free, recipe_lock

_PREFIX, _LOCK, _STAGING = ".fire-atlas-", ".lock", ".staging"


def staging_folder(out: Path, name: str) -> StagingFolder:
    """Return where the files of a build ``name`` into ``out`` wait for their commit."""
    return StagingFolder(out, out / f"{_PREFIX}{name}{_STAGING}")


def recover(out: Path, name: str, note: Callable[[str], None]) -> None:
    """Undo the commit of a build ``name`` into ``out`` that was killed in the middle of it.

    Where there was none, nothing is written or imported. One that is alive is waited for.

    Raises:
        OutputError: It cannot be undone.
    """
    folder = staging_folder(out, name)
    if not folder.journal.exists():
        return
    with explained(out), locked(recipe_lock(out, name), note):
        settle(folder, note)


def tidy(out: Path, name: str, note: Callable[[str], None]) -> None:
    """Do so, and clear away the hidden files of all builds into ``out`` that died.

    Raises:
        OutputError: They cannot be removed.
    """
    recover(out, name, note)
    with explained(out):
        sweep(out, note)


def sweep(out: Path, note: Callable[[str], None]) -> None:
    """Clear away what builds into ``out`` that died have left; what belongs to a live one stays."""
    for name in sorted(_names_of_builds(out)):
        with locked_if_free(recipe_lock(out, name)) as is_dead:
            if is_dead:
                settle(staging_folder(out, name), note)
    if folder_lock(out).exists():
        with locked_if_free(folder_lock(out)):
            pass  # whoever holds a lock last removes its file


def _names_of_builds(out: Path) -> set[str]:
    """Return the names of builds that have left a staging folder or a lock, dead or alive."""
    paths = [path for path in out.glob(f"{_PREFIX}*") if path.suffix in {_LOCK, _STAGING}]
    return {path.stem.removeprefix(_PREFIX) for path in paths}


def settle(folder: StagingFolder, note: Callable[[str], None]) -> None:
    """Undo what a dead build left half way, if it did, and remove its folder; under its lock."""
    if folder.path.is_symlink():  # no build makes one
        folder.path.unlink()
    if folder.journal.exists():
        with locked(folder_lock(folder.out), note):
            undo_unfinished(folder)
    with suppress(FileNotFoundError):
        shutil.rmtree(folder.path)
