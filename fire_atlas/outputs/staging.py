"""Write files into a hidden folder first, and move them into place at the end, all or none."""

import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from fire_atlas.core.errors import OutputError
from fire_atlas.core.files import real
from fire_atlas.core.interruption import if_interrupted, signals_wait
from fire_atlas.core.output_file import Role
from fire_atlas.outputs.disk import readable_errors
from fire_atlas.outputs.journal import HeldStaging, commit
from fire_atlas.outputs.locks import folder_lock, locked, recipe_lock
from fire_atlas.outputs.manifest import OutputEntry
from fire_atlas.outputs.recovery import clear_killed_builds, clear_staging, staging_folder

_MAX_MERGED_BYTES = 16 << 20
"""Largest file that an engine or a user may have edited, and a build merges its settings into."""

_ATTEMPTS = 10
"""How often a folder is removed: threads that a signal has not ended yet may add files to it."""


class Staging:
    """A hidden folder inside the output folder, whose files are renamed into place at the end.

    While it is open, no other process builds the same name into the same folder. A signal that ends
    the process removes it; during the commit, signals wait.
    """

    def __init__(
        self, out: Path, name: str, note: Callable[[str], None], overwrite: bool = False
    ) -> None:
        """Prepare to write into ``out``, which is made when the context is entered.

        Args:
            out: The output folder.
            name: Name of the build.
            note: Called with a sentence if another process is waited for.
            overwrite: Whether files that no build wrote may be replaced.
        """
        self.out = out
        self.name = name
        self.overwrite = overwrite
        self.has_merged = False
        self._note = note
        self._folder = staging_folder(out, name)
        self._held: HeldStaging | None = None
        self._stack = ExitStack()
        self._digests: dict[str, str] = {}  # of the outputs, by name, in the order of writing
        self._inputs: set[Path] = set()

    def __enter__(self) -> Self:
        """Make the folders, and remove what killed builds have left."""
        with self._stack as stack, readable_errors(self.out):
            missing = _missing_folders(self.out)
            _at_the_end(stack, partial(_remove_empty, missing))
            self.out.mkdir(parents=True, exist_ok=True)
            clear_killed_builds(self.out, self._note)
            stack.enter_context(locked(recipe_lock(self.out, self.name), self._note))
            clear_staging(self._folder, self._note)
            _at_the_end(stack, self._clear)
            self._folder.previous.mkdir(parents=True)
            self._held = stack.enter_context(self._folder.held(is_new=bool(missing)))
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Remove everything that was not committed."""
        self._stack.close()

    def protect(self, inputs: Iterable[Path]) -> None:
        """Protect ``inputs`` from being overwritten by outputs."""
        self._inputs.update(real(path) for path in inputs)

    @contextmanager
    def open(self, name: str) -> Iterator[BinaryIO]:
        """Open the output ``name`` for writing."""
        target = self.out / name
        self.refuse(name)
        with readable_errors(target):
            with self._folders.staged.create(name) as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            digest = self._folders.staged.digest(name)
            assert digest is not None
            self._digests[name] = digest

    def entry(self, name: str, role: Role) -> OutputEntry:
        """Return the entry in a manifest of the output ``name``, which was written."""
        return OutputEntry(name, role, self._folders.staged.size(name), self._digests[name])

    def existing(self, name: str) -> bytes | None:
        """Return the bytes that the output ``name`` will replace; None if there are none.

        If there are any, ``has_merged`` is True from now on: the outputs depend on the folder.
        """
        target = self.out / name
        self.refuse(name)
        with readable_errors(target):
            there = self._folders.out.read(name, _MAX_MERGED_BYTES)
            self.has_merged |= there is not None
            return there

    def path(self, name: str) -> Path:
        """Return the path of the output ``name`` until it is committed."""
        return self._folder.path / name

    def folder_locked(self) -> AbstractContextManager[None]:
        """Hold the lock of the output folder, so that no other build commits into it.

        Raises:
            OutputError: Its path, or that of the staging folder, leads to another one by now.
        """
        self._refuse_exchanged()
        return locked(folder_lock(self.out), self._note)

    def commit(self, stale: Iterable[str]) -> None:
        """Move all outputs into place and remove the ``stale`` files of an earlier build.

        The file that was written last, the manifest, marks the commit as complete. A commit that
        fails is undone, so that old and new outputs are never mixed.
        """
        *written, marker = self._digests.items()
        with readable_errors(self.out):
            changes = [
                *(self._folders.change(name, digest) for name, digest in written),
                *(self._folders.change(name, None) for name in stale),
                self._folders.change(*marker),
            ]
            self._refuse_exchanged()
            with signals_wait():
                commit(self._folders, changes)

    def put_in_place(self, name: str) -> None:
        """Move the one file that was written, which no manifest will list, into place."""
        self._refuse_exchanged()
        self._folders.staged.move(name, self._folders.out)

    def refuse(self, name: str) -> None:
        """Raise if the output ``name`` would replace a link, a folder or an input of the build."""
        target = self.out / name
        advice = "choose another `name` or folder (-o)"
        if target.is_symlink() or target.is_dir():
            kind = "a symbolic link" if target.is_symlink() else "a folder"
            raise OutputError(
                f"{target}: is {kind}, which a build never replaces; remove it, or {advice}"
            )
        if real(target) in self._inputs:
            raise OutputError(f"{target}: is an input and would be overwritten; {advice}")

    @property
    def _folders(self) -> HeldStaging:
        assert self._held is not None, "the context was not entered"
        return self._held

    def _clear(self) -> None:
        """Remove the staging folder, unless it has a journal: of a commit that could not be undone,
        which the next command tries to undo again."""
        is_exchanged = self._held is not None and not self._held.staged.is_at_its_path
        if is_exchanged or self._folder.journal.exists():
            return
        for _ in range(_ATTEMPTS):
            shutil.rmtree(self._folder.path, ignore_errors=True)
            if not self._folder.path.exists():
                return

    def _refuse_exchanged(self) -> None:
        for folder in (self._folders.out, self._folders.staged):
            if not folder.is_at_its_path:
                raise OutputError(
                    f"{folder.path}: was moved away, or exchanged for another folder, while this "
                    f"build wrote into it; nothing was put in place; build again"
                )


def refuse_existing(targets: Iterable[Path]) -> None:
    """Raise if any of ``targets``, files that are not outputs of a build, exists.

    Raises:
        OutputError: Some exist, with a line for each.
    """
    taken = [
        f"{target}: exists already" for target in targets if target.exists() and not target.is_dir()
    ]
    if taken:
        advice = "move it away, name another file with -o, or replace it with --overwrite"
        raise OutputError(*taken, f"nothing was written: {advice}")


def write_whole(target: Path, data: bytes, note: Callable[[str], None]) -> None:
    """Write or replace one file that is not an output of a build, whole or not at all.

    If the process is killed, the next command that writes into the folder removes its hidden files.
    ``note`` is called with a sentence if another process is waited for.

    Raises:
        OutputError: It cannot be written.
    """
    if target.is_dir():
        raise OutputError(f"{target}: is a folder; name the file in it to write")
    if not target.parent.is_dir():
        raise OutputError(f"{target}: cannot be written (there is no folder {target.parent})")
    with Staging(target.parent, target.name, note) as staging:
        with staging.open(target.name) as file:
            file.write(data)
        with readable_errors(target):
            staging.put_in_place(target.name)


def _at_the_end(stack: ExitStack, action: Callable[[], None]) -> None:
    """Run ``action`` when the stack is closed, and also if a signal ends the process before that is
    done: a signal may arrive in the middle of it."""
    stack.enter_context(if_interrupted(action))
    stack.callback(action)


def _remove_empty(folders: Sequence[Path]) -> None:
    """Remove those of ``folders``, innermost first, that are empty."""
    for folder in folders:
        with suppress(OSError):  # it holds outputs now, or never was made
            folder.rmdir()


def _missing_folders(path: Path) -> list[Path]:
    """Return ``path`` and its parents that do not exist yet, innermost first."""
    return [folder for folder in (path, *path.parents) if not folder.exists()]
