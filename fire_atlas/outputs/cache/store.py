"""Stores that keep the entries of a cache: a folder, or any store that fsspec speaks.

Nothing is expected of a store but that it gives back what was written: an entry that is cut off,
damaged or forged is found by whoever reads it (``archive``).
"""

import errno
import os
import re
import shutil
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol

from fire_atlas.core.files import open_file
from fire_atlas.core.interruption import if_interrupted
from fire_atlas.outputs.folder import temporary_folder

if TYPE_CHECKING:
    from fsspec import AbstractFileSystem

_ENDING = ".tar"
_ENTRY = re.compile(rf"[0-9a-f]{{64}}{re.escape(_ENDING)}")
"""File name of an entry: the digest of its key. Other files in a store are left alone."""

_DRAFT = re.compile(rf"\.{_ENTRY.pattern}\.[0-9a-f]{{16}}\.tmp")
"""File name of an entry of a folder until it is complete."""

_NO_ENTRY = (errno.ENOENT, errno.EISDIR, errno.EINVAL, errno.ELOOP, errno.ENXIO)
"""Errors of opening what is no entry, and is replaced by one: nothing, a folder, a pipe, a device
or a link that leads in a circle."""

_SILENCE = 10
"""Seconds without a byte from a server, or to it, after which it counts as one that cannot be
reached."""

_IN_TRANSIT = 8 << 20
"""Bytes that systems on both sides hold at most between a sender and who reads: Linux's largest
buffers of a connection (4 and 6 MiB), about."""

_SENT_BYTES = 1 << 16
"""Bytes of an entry that are handed to the connection at a time: progress is seen in these."""

_DRAFT_SECONDS = 24 * 3600
"""Age from which a draft is one that a killed process has left."""


class StoreError(Exception):
    """A store cannot be reached, read or written; the message says which and why."""


@dataclass(frozen=True, slots=True)
class StoredEntry:
    """An entry of a cache, as its store lists it.

    Attributes:
        digest: Of its key.
        size: In bytes.
        used: When it was last used or, in stores that do not record that, written; seconds since
            1970. None if the store does not say.
    """

    digest: str
    size: int
    used: float | None


class Readable(Protocol):
    """A stream of bytes."""

    def read(self, size: int = -1, /) -> bytes:
        """Return at most ``size`` bytes, none at the end."""


class Store(Protocol):
    """A place for entries. All methods raise ``StoreError``."""

    def open(self, digest: str) -> AbstractContextManager[Readable | None]:
        """Open an entry for reading; give None if there is none."""

    def write(self, digest: str, write: Callable[[BinaryIO], None]) -> None:
        """Write or replace an entry: ``write`` gets a file to write it to."""

    def touch(self, digest: str) -> None:
        """Record that an entry was used now, if the store can."""

    def entries(self) -> list[StoredEntry]:
        """List all entries."""

    def remove(self, digest: str) -> None:
        """Remove an entry, if it is still there."""

    def remove_drafts(self) -> None:
        """Remove the incomplete entries that killed processes have left."""


@cache
def open_store(location: str) -> Store:
    """Return the store at ``location``, a folder or a URL, opened once in a process.

    Raises:
        StoreError: The URL is invalid, or needs a package that is not installed.
    """
    return _RemoteStore(location) if "://" in location else _FolderStore(Path(location))


class _FolderStore:
    """A folder, safe for many processes and machines: files appear in it whole, by renaming."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @contextmanager
    def open(self, digest: str) -> Iterator[Readable | None]:
        path = self._path(digest)
        try:
            file = open_file(path)
        except OSError as error:
            if error.errno not in _NO_ENTRY:
                raise _store_error(path, error) from error
            yield None
            return
        with file:
            yield _StoreStream(file, str(path))

    def write(self, digest: str, write: Callable[[BinaryIO], None]) -> None:
        path = self._path(digest)
        draft = path.with_name(f".{path.name}.{os.urandom(8).hex()}.tmp")
        remove = partial(_remove_draft, draft)
        with _errors_of(self._folder), if_interrupted(remove):
            try:
                self._folder.mkdir(parents=True, exist_ok=True)
                with draft.open("xb") as file:
                    write(file)
                if path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path, ignore_errors=True)
                draft.replace(path)
            finally:
                remove()

    def touch(self, digest: str) -> None:
        with suppress(OSError):  # another user's file
            os.utime(self._path(digest))

    def entries(self) -> list[StoredEntry]:
        with _errors_of(self._folder):
            return [entry for path in self._folder.iterdir() for entry in _listed(path)]

    def remove(self, digest: str) -> None:
        with _errors_of(self._folder):
            self._path(digest).unlink(missing_ok=True)

    def remove_drafts(self) -> None:
        with _errors_of(self._folder):
            for path in self._folder.iterdir():
                if _DRAFT.fullmatch(path.name) and _is_old(path):
                    path.unlink(missing_ok=True)

    def _path(self, digest: str) -> Path:
        return self._folder / (digest + _ENDING)


def _is_old(draft: Path) -> bool:
    """Return whether a draft is too old to be written still; False if it is gone."""
    try:
        return draft.stat().st_mtime < time.time() - _DRAFT_SECONDS
    except FileNotFoundError:
        return False


def _remove_draft(draft: Path) -> None:
    with suppress(OSError):
        draft.unlink()


def _listed(path: Path) -> Iterator[StoredEntry]:
    """Yield the entry that a file of a folder is, if it is one."""
    if _ENTRY.fullmatch(path.name) and path.is_file():
        with suppress(FileNotFoundError):  # removed by another process meanwhile
            about = path.stat()
            yield StoredEntry(path.stem, about.st_size, about.st_mtime)


_STREAMED = {"block_size": 0, "size": 1}
"""Options of fsspec's HTTP to get a file by one request, also from servers without ranges.

With any ``size`` it does not ask for the real one first. It would take every failure of that
request for a missing file, and so a server that cannot be reached for one with no entries.
"""


class _RemoteStore:
    """A store that fsspec speaks. Entries are sent whole, from a local temporary file."""

    def __init__(self, url: str) -> None:
        self._url = url
        with _errors_of(url):
            self._files, self._root = _file_system(url)
        self._is_http = _is_http(url)
        self._reading = _STREAMED if self._is_http else {}

    @contextmanager
    def open(self, digest: str) -> Iterator[Readable | None]:
        try:
            file = self._files.open(self._path(digest), "rb", **self._reading)
        except FileNotFoundError:
            yield None
            return
        except Exception as error:  # each store raises its own
            raise _store_error(self._url, error) from error
        with file:
            yield _StoreStream(file, self._url)

    def write(self, digest: str, write: Callable[[BinaryIO], None]) -> None:
        with _errors_of(self._url), temporary_folder() as folder:
            local = folder / digest
            with local.open("xb") as file:
                write(file)
            with suppress(NotImplementedError):  # HTTP has no folders
                self._files.makedirs(self._root, exist_ok=True)
            if self._is_http:
                _put(self._files, str(local), self._path(digest))
            else:
                self._files.put_file(str(local), self._path(digest))

    def touch(self, digest: str) -> None:
        """Do nothing: these stores keep only when an entry was written."""

    def entries(self) -> list[StoredEntry]:
        with _errors_of(self._url):
            self._files.invalidate_cache()
            listed = self._files.ls(self._root, detail=True)
            return [
                self._entry(entry) for entry in listed if _ENTRY.fullmatch(_stem(entry) + _ENDING)
            ]

    def remove(self, digest: str) -> None:
        with _errors_of(self._url), suppress(FileNotFoundError):
            self._files.rm_file(self._path(digest))

    def remove_drafts(self) -> None:
        """Do nothing: there are none."""

    def _path(self, digest: str) -> str:
        return f"{self._root.rstrip('/')}/{digest}{_ENDING}"

    def _entry(self, listed: dict[str, Any]) -> StoredEntry:
        try:
            used = self._files.modified(listed["name"]).timestamp()
        except NotImplementedError:
            used = None
        return StoredEntry(_stem(listed), listed["size"] or 0, used)


def _stem(listed: dict[str, Any]) -> str:
    """Return the file name, without its ending, of an entry in a listing of fsspec."""
    return str(listed["name"]).rpartition("/")[2].removesuffix(_ENDING)


def _file_system(url: str) -> "tuple[AbstractFileSystem, str]":
    """Return the file system of a URL, and the path in it."""
    try:
        from fsspec.core import url_to_fs
    except ModuleNotFoundError:
        raise StoreError(
            f"{_without_password(url)}: needs a package that is not installed; "
            f"pip install 'fire-atlas[cache]'"
        ) from None
    options = {}
    if _is_http(url):
        import aiohttp

        limits = aiohttp.ClientTimeout(total=None, sock_connect=_SILENCE, sock_read=_SILENCE)
        options = {"client_kwargs": {"timeout": limits}}
    files, root = url_to_fs(url, **options)
    return files, root


def _put(files: "AbstractFileSystem", local: str, path: str) -> None:
    """Write an entry to a web server by PUT, as caches do (Bazel's, sccache's).

    The client limits how long a server may be silent when it has to answer, but not how long it may
    take nothing of what is sent. That is limited here.

    Raises:
        TimeoutError: The server took nothing, or said nothing, for ``_SILENCE`` seconds.
    """
    import asyncio

    from fsspec.asyn import sync

    async def put() -> None:
        session, now = await files.set_session(), asyncio.get_running_loop().time
        began, size = now(), max(Path(local).stat().st_size, 1)
        with Path(local).open("rb") as source:
            async with asyncio.timeout(_SILENCE) as limit:

                async def chunks() -> AsyncIterator[bytes]:
                    while data := source.read(_SENT_BYTES):
                        limit.reschedule(now() + _SILENCE)
                        yield data
                    # What the system has taken it still has to send, as fast as it sent the rest.
                    rest = (now() - began) * min(1.0, _IN_TRANSIT / size)
                    limit.reschedule(now() + rest + _SILENCE)

                url = files.encode_url(path)
                async with session.put(url, data=chunks(), **files.kwargs) as answer:
                    files._raise_not_found_for_status(answer, path)

    sync(files.loop, put)


def _is_http(url: str) -> bool:
    return url.startswith(("http://", "https://"))


class _StoreStream:
    """A stream from a store, whose errors are ``StoreError``s."""

    def __init__(self, source: BinaryIO, where: str) -> None:
        self._source = source
        self._where = where

    def read(self, size: int = -1, /) -> bytes:
        with _errors_of(self._where):
            return self._source.read(size)


@contextmanager
def _errors_of(where: str | Path) -> Iterator[None]:
    """Turn what a store raises, which may be anything, into a ``StoreError``."""
    try:
        yield
    except StoreError:
        raise
    except Exception as error:
        raise _store_error(where, error) from error


def _store_error(where: str | Path, error: Exception) -> StoreError:
    reason = " ".join(str(error).split()) or type(error).__name__
    if isinstance(error, TimeoutError) and error.errno is None:
        reason = f"the server takes and gives nothing for {_SILENCE} s"
    elif isinstance(error, OSError) and error.strerror:
        reason = error.strerror
    elif isinstance(error, FileNotFoundError):  # which names no reason in fsspec
        reason = "not found, or this store cannot list what it has"
    return StoreError(_without_password(f"{where}: {reason}"))


def _without_password(text: str) -> str:
    """Return ``text`` without the user names, passwords and queries of the URLs in it."""
    return re.sub(r"(?<=://)[^/@\s]*@|\?[^\s:]*", "", text)
