"""Commit a build: make all its changes to an output folder, or none if the process is killed.

Before the first change, every file that will be replaced or removed is saved in the staging folder,
and a journal there lists the changes. A journal that is still there later belongs to an unfinished
commit, which is undone. The last file of a commit, the manifest, is its marker: it is removed
before any other file changes and put in place after all of them, so that no manifest ever lists a
mixture of old and new files. Each step is synced to the disk before the next begins, so that a
commit cut off by a power failure can be undone as well.
"""

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fire_atlas.core.output_file import is_reserved, name_below
from fire_atlas.outputs.disk import HeldFolder, is_regular, readable_errors

_JOURNAL = ".journal"
_FORMAT, _VERSION = "fire-atlas/journal", 1
_DIGEST = re.compile("[0-9a-f]{64}")

_MAX_BYTES = 1 << 26
"""Maximum size of a journal; that of a hundred thousand files is smaller."""


@dataclass(frozen=True, slots=True)
class Change:
    """A change that a commit makes to one file of the output folder.

    Attributes:
        name: Name of the file, as in a manifest.
        before: SHA-256 of the file before the commit; None if there is none.
        after: SHA-256 of the file after the commit; None if it is removed.
    """

    name: str
    before: str | None
    after: str | None


@dataclass(frozen=True, slots=True)
class StagingFolder:
    """A hidden folder in an output folder that holds the files of a build until the commit.

    Attributes:
        out: The output folder.
        path: The staging folder.
    """

    out: Path
    path: Path

    @property
    def previous(self) -> Path:
        """The folder that keeps the files that are replaced or removed."""
        return self.path / ".previous"

    @property
    def journal(self) -> Path:
        """The journal, a file that exists while a commit is not finished."""
        return self.path / _JOURNAL

    @contextmanager
    def held(self, *, is_new: bool = False) -> Iterator["HeldStaging"]:
        """Hold the folders open. ``is_new``: the caller has made the output folder, so it is no
        link.

        Raises:
            OSError: One of them is missing, or a link.
        """
        with ExitStack() as stack:
            out = HeldFolder(self.out, may_be_link=not is_new)
            stack.callback(out.close)
            staged = HeldFolder(self.path, out)
            stack.callback(staged.close)
            previous = HeldFolder(self.previous, staged)
            stack.callback(previous.close)
            yield HeldStaging(out, staged, previous)


@dataclass(frozen=True, slots=True)
class HeldStaging:
    """The folders of a staging folder, held open.

    Attributes:
        out: The output folder.
        staged: The staging folder.
        previous: The folder that keeps the files that are replaced or removed.
    """

    out: HeldFolder
    staged: HeldFolder
    previous: HeldFolder

    def change(self, name: str, after: str | None) -> Change:
        """Return the change of the file ``name`` to the staged one, of which ``after`` is the
        SHA-256; None removes it."""
        return Change(name, self.out.digest(name), after)


def commit(folders: HeldStaging, changes: Sequence[Change]) -> None:
    """Make all ``changes``. The last one is the marker (the manifest): its old file is removed
    before all others change, and its new file put in place after them.

    Raises:
        OSError: A change failed, and all were undone. If undoing failed with an error too, the
            journal stays, so that the next command tries again.
    """
    _keep_previous(folders, changes)
    _write_journal(folders, changes)
    *others, marker = changes
    try:
        _remove_marker(folders, marker)
        for change in others:
            _apply(folders, change)
        folders.out.sync()
        _apply(folders, marker)
        folders.out.sync()
    except BaseException:
        _undo(folders, changes)
        raise
    with suppress(OSError):  # if it stays, the marker shows that the commit is finished
        folders.staged.unlink(_JOURNAL)


def undo_unfinished(folder: StagingFolder) -> None:
    """Undo the commit that a journal lists, if it was not finished.

    The journal is untrusted input: only files with the digests that it states are changed.
    """
    if changes := _read_journal(folder):
        folder.previous.mkdir(exist_ok=True)  # it may have been removed before the journal was
        with folder.held() as folders:
            if folders.out.digest(changes[-1].name) != changes[-1].after:
                _undo(folders, changes)
            folders.staged.unlink(_JOURNAL)
            folders.staged.sync()
    else:
        folder.journal.unlink(missing_ok=True)


def _keep_previous(folders: HeldStaging, changes: Sequence[Change]) -> None:
    for change in changes:
        if change.before is not None:
            with readable_errors(folders.out.path / change.name):
                folders.out.link_or_copy(change.name, folders.previous)
    folders.previous.sync()


def _write_journal(folders: HeldStaging, changes: Sequence[Change]) -> None:
    document = {"format": _FORMAT, "version": _VERSION, "changes": [asdict(c) for c in changes]}
    draft = f"{_JOURNAL}.draft"
    folders.staged.write_synced(draft, json.dumps(document).encode())
    folders.staged.move(draft, folders.staged, _JOURNAL)
    folders.staged.sync()
    folders.out.sync()


def _read_journal(folder: StagingFolder) -> list[Change]:
    """Return the changes in a journal; none if it is not valid."""
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        is_own = not (folder.path.is_symlink() or folder.previous.is_symlink())
        if is_own and is_regular(folder.journal) and folder.journal.stat().st_size <= _MAX_BYTES:
            document: Any = json.loads(folder.journal.read_bytes())
            if (document["format"], document["version"]) == (_FORMAT, _VERSION):
                return _validated([Change(**change) for change in document["changes"]])
    return []


def _validated(changes: list[Change]) -> list[Change]:
    """Return ``changes`` if a build may write their files; only the last may be a manifest.

    Raises:
        ValueError: A build may not write one of them.
    """
    names = [name_below(change.name) for change in changes]
    digests = {digest for change in changes for digest in (change.before, change.after)}
    if not all(digest is None or _DIGEST.fullmatch(digest) for digest in digests):
        raise ValueError("no digest of a file")
    if any(map(is_reserved, names[:-1])):
        raise ValueError("the name is reserved for manifests and hidden files")
    return changes


def _apply(folders: HeldStaging, change: Change) -> None:
    with readable_errors(folders.out.path / change.name):
        if change.after is None:
            folders.out.unlink(change.name)
        else:
            folders.staged.move(change.name, folders.out)


def _remove_marker(folders: HeldStaging, marker: Change) -> None:
    """Remove the marker of a commit before any file that it lists changes."""
    with readable_errors(folders.out.path / marker.name):
        folders.out.unlink(marker.name)
        folders.out.sync()


def _undo(folders: HeldStaging, changes: Sequence[Change]) -> None:
    """Put every file back as it was: remove the marker first, and restore it last.

    If the old bytes of a file are lost, the marker stays away, so that the next build makes all
    files again. The journal goes then too, as another attempt could do no more.
    """
    *others, marker = changes
    if folders.out.digest(marker.name) == marker.after:
        _remove_marker(folders, marker)
    are_restored = [_restore(folders, change) for change in others]
    folders.out.sync()
    if all(are_restored):
        _restore(folders, marker)
        folders.out.sync()
    folders.staged.unlink(_JOURNAL)


def _restore(folders: HeldStaging, change: Change) -> bool:
    """Restore one file; return False if its old bytes are lost.

    A file that differs from both states was written by a user, and stays.
    """
    now = folders.out.digest(change.name)
    if now == change.before or now not in {None, change.after}:
        return True
    if change.before is None:
        folders.out.unlink(change.name)
    elif folders.previous.digest(change.name) == change.before:
        folders.previous.move(change.name, folders.out)
    else:
        return False
    return True
