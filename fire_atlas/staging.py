"""Outputs appear all at once or not at all."""

import errno
import shutil
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from fire_atlas.core.errors import OutputError

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


class Staging:
    """A hidden folder inside the output folder, whose files are renamed into place at the end."""

    def __init__(self, out: Path) -> None:
        """Prepare to write into ``out``, which is made when the context is entered."""
        self.out = out
        self._names: list[str] = []

    def __enter__(self) -> Self:
        """Make the folders."""
        with explained(self.out):
            self._made = _missing_folders(self.out)
            self.out.mkdir(parents=True, exist_ok=True)
            self._folder = Path(tempfile.mkdtemp(prefix=".fire-atlas-", dir=self.out))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Leave nothing behind but what was committed."""
        shutil.rmtree(self._folder, ignore_errors=True)
        for folder in self._made:
            if not any(folder.iterdir()):
                folder.rmdir()

    @contextmanager
    def open(self, name: str) -> Iterator[BinaryIO]:
        """Open the output ``name`` for writing."""
        target = self.out / name
        if target.is_symlink() or target.is_dir():
            kind = "a symbolic link" if target.is_symlink() else "a folder"
            raise OutputError(
                f"{target}: is {kind}, which a build never writes through; remove it, or choose "
                f"another `name` or folder (-o)"
            )
        with explained(target), (self._folder / name).open("wb") as file:
            yield file
        self._names.append(name)

    def path(self, name: str) -> Path:
        """Where the output ``name`` lies until it is committed."""
        return self._folder / name

    def commit(self, stale: list[Path]) -> None:
        """Put everything in place, then remove the ``stale`` files of an earlier build.

        Signals wait meanwhile, so that outputs never are a mixture.
        """
        with explained(self.out), _signals_held():
            for name in self._names:
                self.path(name).replace(self.out / name)
            for path in stale:
                path.unlink(missing_ok=True)


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


@contextmanager
def _signals_held() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
