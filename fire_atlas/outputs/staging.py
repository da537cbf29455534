"""Outputs appear all at once or not at all."""

import errno
import shutil
import uuid
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import gettempdir
from types import TracebackType
from typing import BinaryIO, Self

from fire_atlas.core.errors import OutputError
from fire_atlas.core.interruption import if_interrupted, signals_wait

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


class Staging:
    """A hidden folder inside the output folder, whose files are renamed into place at the end.

    Signals wait meanwhile; at any other time they remove it.
    """

    def __init__(self, out: Path) -> None:
        """Prepare to write into ``out``, which is made when the context is entered."""
        self.out = out
        self._folder = out / f".fire-atlas-{uuid.uuid4().hex[:12]}"
        self._previous = self._folder / ".previous"
        self._made: list[Path] = []
        self._names: list[str] = []
        self._kept: set[Path] = set()
        self._interruptible = ExitStack()

    def __enter__(self) -> Self:
        """Make the folders."""
        self._interruptible.enter_context(if_interrupted(self._tidy))
        try:
            with explained(self.out):
                self._made = _missing_folders(self.out)
                self.out.mkdir(parents=True, exist_ok=True)
                self._previous.mkdir(parents=True)
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Leave nothing behind but what was committed."""
        self._tidy()
        self._interruptible.close()

    def keep(self, inputs: Iterable[Path]) -> None:
        """Refuse to write over any of ``inputs`` from now on."""
        self._kept.update(path.resolve() for path in inputs)

    @contextmanager
    def open(self, name: str) -> Iterator[BinaryIO]:
        """Open the output ``name`` for writing."""
        target = self.out / name
        self._refuse(target)
        with explained(target), self.path(name).open("wb") as file:
            yield file
        self._names.append(name)

    def existing(self, name: str) -> bytes | None:
        """Return what lies now where the output ``name`` will go, if anything does."""
        target = self.out / name
        self._refuse(target)
        with explained(target):
            return target.read_bytes() if target.is_file() else None

    def path(self, name: str) -> Path:
        """Where the output ``name`` lies until it is committed."""
        return self._folder / name

    def commit(self, stale: Iterable[Path]) -> None:
        """Put everything in place and remove the ``stale`` files of an earlier build.

        What fails is undone, so that outputs never are a mixture.
        """
        with signals_wait(), ExitStack() as undo:
            for name in self._names:
                self._put(name, undo)
            for path in stale:
                self._take_away(path, undo)
            undo.pop_all()

    def _refuse(self, target: Path) -> None:
        """Raise if ``target`` is nothing a build may replace."""
        advice = "choose another `name` or folder (-o)"
        if target.is_symlink() or target.is_dir():
            kind = "a symbolic link" if target.is_symlink() else "a folder"
            raise OutputError(
                f"{target}: is {kind}, which a build never replaces; remove it, or {advice}"
            )
        if target.resolve() in self._kept:
            raise OutputError(f"{target}: would be written over, but is read as input; {advice}")

    def _put(self, name: str, undo: ExitStack) -> None:
        target, previous = self.out / name, self._previous / name
        with explained(target):
            is_new = not target.exists()
            if not is_new:
                _link_or_copy(target, previous)
            self.path(name).replace(target)
        if is_new:
            undo.callback(target.unlink)
        else:
            undo.callback(previous.replace, target)

    def _take_away(self, path: Path, undo: ExitStack) -> None:
        aside = self._previous / path.name
        with explained(path):
            path.replace(aside)
        undo.callback(aside.replace, path)

    def _tidy(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)
        for folder in self._made:
            with suppress(OSError):  # it holds outputs now, or never was made
                folder.rmdir()


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Make a folder that is gone afterwards, however that comes about."""
    folder = Path(gettempdir()) / f"fire-atlas-{uuid.uuid4().hex}"
    remove = partial(shutil.rmtree, folder, ignore_errors=True)
    with if_interrupted(remove):
        try:
            with explained(folder):
                folder.mkdir(mode=0o700)
            yield folder
        finally:
            remove()


def write_whole(target: Path, data: bytes) -> None:
    """Write a file that is no output of a build: whole, or not at all."""
    if target.is_dir():
        raise OutputError(f"{target}: is a folder; name the file in it that is to be written")
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex[:12]}")
    with explained(target), if_interrupted(partial(temporary.unlink, missing_ok=True)):
        try:
            temporary.write_bytes(data)
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn the operating system's errors about ``path`` into advice."""
    try:
        yield
    except PermissionError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror}); choose another folder with -o, or "
            f"change its permissions"
        ) from error
    except (FileExistsError, NotADirectoryError) as error:
        raise OutputError(f"{path}: a file is in the way of the output folder") from error
    except OSError as error:
        if error.errno in _FULL:
            raise OutputError(
                f"{path}: the disk is full ({error.strerror}); the previous outputs are whole. "
                f"Free some space, or choose another folder with -o"
            ) from error
        raise OutputError(f"{path}: cannot be written ({error.strerror})") from error


def _missing_folders(path: Path) -> list[Path]:
    """Folders from ``path`` upwards that do not exist yet, innermost first."""
    return [folder for folder in (path, *path.parents) if not folder.exists()]


def _link_or_copy(path: Path, to: Path) -> None:
    """Keep the file ``path`` at ``to`` as well, so that it never is missing in between."""
    try:
        to.hardlink_to(path)
    except OSError:  # not every file system knows hard links
        shutil.copy2(path, to)
