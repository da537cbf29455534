"""File operations of builds: writes that survive a power cut, and errors that give advice."""

import errno
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader, BufferedWriter
from pathlib import Path

from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.digest import sha256_of

_HAS_OPEN_FOLDERS = os.open in os.supports_dir_fd
"""Whether the system has paths that begin at an open folder."""

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_NO_FILE = {errno.ENOENT, errno.ELOOP, errno.EISDIR, errno.ENXIO}
"""Errors of opening where nothing is, or a link, folder or socket."""


@contextmanager
def readable_errors(path: Path) -> Iterator[None]:
    """Turn the operating system's errors about ``path`` into an OutputError that gives advice."""
    try:
        yield
    except PermissionError as error:
        raise OutputError(
            f"{path}: cannot be written ({error.strerror}); choose another folder (of a build: "
            f"-o), or change its permissions"
        ) from error
    except (FileExistsError, NotADirectoryError) as error:
        raise OutputError(f"{path}: a file is in the way of the output folder") from error
    except OSError as error:
        if error.errno in _FULL:
            raise OutputError(
                f"{path}: the disk is full ({error.strerror}); the previous outputs are unchanged. "
                f"Free some space, or choose another folder (of a build: -o)"
            ) from error
        if error.errno == errno.EROFS:
            raise OutputError(
                f"{path}: cannot be written ({error.strerror}); choose another folder (of a "
                f"build: -o)"
            ) from error
        raise OutputError(f"{path}: cannot be written ({error.strerror})") from error


class HeldFolder:
    """A folder that is held open: what is done to its files is done in this folder, even if another
    one, or a link, has taken its path by then. No link among its files and folders is followed.

    Files in folders of it have names with ``/``. A folder that is missing where a file is put is
    made.

    Windows has no paths that begin at an open folder: there the path is used.
    """

    def __init__(
        self, path: Path, inside: "HeldFolder | None" = None, *, may_be_link: bool = False
    ) -> None:
        """Hold a folder, which may be a link to one if the caller says so; or the one of this name
        ``inside`` another.

        Raises:
            OSError: There is none.
        """
        self.path = path
        self._folders: dict[str, HeldFolder] = {}
        self._descriptor: int | None = None
        if _HAS_OPEN_FOLDERS:
            parent = None if inside is None else inside._descriptor
            flags = os.O_RDONLY | os.O_DIRECTORY | (0 if may_be_link else os.O_NOFOLLOW)
            name = path if parent is None else path.name
            self._descriptor = os.open(name, flags, dir_fd=parent)
        self._identity = path.stat() if self._descriptor is None else os.fstat(self._descriptor)

    def close(self) -> None:
        """Hold the folder, and those in it, no longer."""
        for folder in self._folders.values():
            folder.close()
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    @property
    def is_at_its_path(self) -> bool:
        """Whether the path still leads to this folder."""
        try:
            return os.path.samestat(self._identity, self.path.stat())
        except OSError:
            return False

    def create(self, name: str) -> BufferedWriter:
        """Open a new file for writing, in place of one that may be there."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        try:
            return os.fdopen(self._open(name, flags), "wb")
        except FileExistsError:
            self.unlink(name)
            return os.fdopen(self._open(name, flags), "wb")

    def write_synced(self, name: str, data: bytes) -> None:
        """Write a file and wait until its bytes are on the disk."""
        with self.create(name) as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())

    def read(self, name: str, max_bytes: int) -> bytes | None:
        """Return the bytes of a file; None if none is there.

        Raises:
            OSError: It is larger than ``max_bytes``.
        """
        with self._existing(name) as file:
            data = None if file is None else file.read(max_bytes + 1)
        if data is not None and len(data) > max_bytes:
            raise OSError(errno.EFBIG, "is too large for what a build merges into", name)
        return data

    def digest(self, name: str) -> str | None:
        """Return the SHA-256 of a file, None if nothing is there, "" for what is no file."""
        with self._existing(name) as file:
            if file is not None:
                return sha256_of(file)
        try:
            path, held = self._at(name)
            os.stat(path, dir_fd=held, follow_symlinks=False)
        except FileNotFoundError:
            return None
        return ""

    def size(self, name: str) -> int:
        """Return the size of a file in bytes."""
        path, held = self._at(name)
        return os.stat(path, dir_fd=held, follow_symlinks=False).st_size

    def unlink(self, name: str) -> None:
        """Remove a file, if it is there."""
        with suppress(FileNotFoundError):
            path, held = self._at(name)
            os.unlink(path, dir_fd=held)

    def move(self, name: str, to: "HeldFolder", new_name: str | None = None) -> None:
        """Move a file into another folder, or give it another name, in place of what is there."""
        path, held = self._at(name)
        target, target_held = to._at(new_name or name, makes_folders=True)
        os.replace(path, target, src_dir_fd=held, dst_dir_fd=target_held)

    def link_or_copy(self, name: str, to: "HeldFolder") -> None:
        """Make a hard link to a file in another folder, or a copy where there are no hard links."""
        path, held = self._at(name)
        target, target_held = to._at(name, makes_folders=True)
        try:
            if held is None:
                os.link(path, target)
            else:
                os.link(
                    path, target, src_dir_fd=held, dst_dir_fd=target_held, follow_symlinks=False
                )
        except OSError:  # not every file system has hard links
            with os.fdopen(self._open(name, os.O_RDONLY), "rb") as source, to.create(name) as copy:
                shutil.copyfileobj(source, copy)
                copy.flush()
                os.fsync(copy.fileno())

    def sync(self) -> None:
        """Wait until the names of the files are on the disk, if the system can do that."""
        for folder in self._folders.values():
            folder.sync()
        if self._descriptor is None:
            return
        try:
            os.fsync(self._descriptor)
        except OSError as error:
            if error.errno not in {errno.EINVAL, errno.EOPNOTSUPP}:
                raise

    @contextmanager
    def _existing(self, name: str) -> Iterator[BufferedReader | None]:
        """Open a file for reading, if one is there: not a link, folder, pipe or device."""
        try:
            file = os.fdopen(self._open(name, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb")
        except OSError as error:
            if error.errno not in _NO_FILE:
                raise
            yield None
            return
        with file:
            yield file if stat.S_ISREG(os.fstat(file.fileno()).st_mode) else None

    def _open(self, name: str, flags: int) -> int:
        path, held = self._at(name, makes_folders=bool(flags & os.O_CREAT))
        return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o666, dir_fd=held)

    def _at(self, name: str, *, makes_folders: bool = False) -> tuple[str, int | None]:
        """Return how to name a file to the system: its path, and the open folder this begins at."""
        first, slash, rest = name.partition("/")
        if slash:
            return self._inside(first, makes_folders)._at(rest, makes_folders=makes_folders)
        if self._descriptor is None:
            return str(self.path / name), None
        return name, self._descriptor

    def _inside(self, name: str, makes_it: bool) -> "HeldFolder":
        """Hold the folder of this name in this one."""
        if name not in self._folders:
            if makes_it:
                path, held = self._at(name)
                with suppress(FileExistsError):
                    os.mkdir(path, dir_fd=held)
            self._folders[name] = HeldFolder(self.path / name, self)
        return self._folders[name]


def is_regular_in(out: Path, name: str) -> bool:
    """Return whether the output ``name`` of a folder is a file, with no link on the way to it."""
    *folders, file = name.split("/")
    for folder in folders:
        out = out / folder
        if out.is_symlink():
            return False
    return is_regular(out / file)


def is_regular(path: Path) -> bool:
    """Return whether ``path`` is a file, and not a link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False
