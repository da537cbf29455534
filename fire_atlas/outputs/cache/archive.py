"""The archive that holds one build in a cache: an uncompressed tar of a manifest and its outputs.

The members, in order, are the manifest, a seal and the outputs as the manifest lists them. The
manifest has the digest of each output, and the seal that of the manifest with, if the cache is
signed, an HMAC-SHA256. So an archive is read once, as a stream, and nothing in it is believed that
has not been checked before. Equal builds have equal archives.
"""

import hashlib
import hmac
import io
import json
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, BinaryIO, Self

from fire_atlas.core.files import MIB, open_file, read_file
from fire_atlas.core.output_file import as_file_name, is_portable, is_reserved
from fire_atlas.outputs.cache.key import CacheKey
from fire_atlas.outputs.cache.store import Readable
from fire_atlas.outputs.manifest import Manifest, OutputEntry, decode_manifest, manifest_name

_SEAL = ".seal"
"""Name of the seal; no output has one that begins with a dot."""

_MAX_MANIFEST_BYTES = 8 * MIB
"""Limit on the size of a manifest in an archive: that of some 60,000 inputs. It is parsed before
anyone knows who wrote it, and takes up to 40 times as much memory then."""

_MAX_BYTES = 4096 * MIB
"""Limit on the size of all outputs in an archive."""

_HEADER_BYTES = 64 << 10
"""Limit on what is read beyond the contents of a member: its header, and the reader's buffer."""

_CHUNK = MIB


class CacheMissError(Exception):
    """A cache has no entry for a build, or one that cannot be used; the message says why."""


class SignatureError(CacheMissError):
    """An archive is not signed with the user's key."""


def write_archive(target: BinaryIO, out: Path, name: str, secret: bytes | None) -> None:
    """Write the archive of the build ``name``, whose files are in ``out``.

    Args:
        target: Where the archive is written.
        out: The output folder.
        name: Name of the build.
        secret: Key to sign with; None for an unsigned archive.

    Raises:
        OSError: A file cannot be read, or ``target`` not be written.
        ValueError: The manifest is invalid.
    """
    file = manifest_name(name)
    data = read_file(out / file, _MAX_MANIFEST_BYTES)
    manifest = decode_manifest(data)
    seal = _Seal.of(CacheKey.of_manifest(manifest), data, secret).encode()
    with tarfile.open(fileobj=target, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for member, content in ((file, data), (_SEAL, seal)):
            archive.addfile(_header(member, len(content)), io.BytesIO(content))
        for entry in manifest.outputs:
            with open_file(out / entry.name) as source:
                archive.addfile(_header(entry.name, entry.size), source)


def is_too_large(manifest: Manifest, out: Path) -> bool:
    """Return whether a build, whose files are in ``out``, exceeds what is read of an archive."""
    size = (out / manifest_name(manifest.name)).stat().st_size
    outputs = sum(entry.size for entry in manifest.outputs)
    return size > _MAX_MANIFEST_BYTES or outputs > _MAX_BYTES


def _header(name: str, size: int) -> tarfile.TarInfo:
    """Return the header of a member, without time and owner."""
    header = tarfile.TarInfo(name)
    header.size = size
    return header


class ArchiveReader:
    """Reads an archive as a stream: its manifest first, then the outputs in their order.

    An archive may come from anyone. No more is read of it than its manifest allows, and none of its
    members may have another name, size or content than the manifest states.
    """

    def __init__(self, source: Readable, key: CacheKey, secret: bytes | None) -> None:
        """Prepare to read the archive of the build ``key``, signed with ``secret`` if given."""
        self._source = _LimitedStream(source)
        self._key = key
        self._secret = secret

    def read_manifest(self, name: str) -> tuple[bytes, Manifest]:
        """Return the manifest of the build ``name``, as bytes and decoded.

        Raises:
            CacheMissError: It is damaged, not signed as required, or is of another build.
        """
        with _damage_reported():
            self._source.allow(0)
            self._archive = tarfile.open(fileobj=self._source, mode="r|")  # noqa: SIM115
            data = self._read(manifest_name(name), _MAX_MANIFEST_BYTES)
            seal = _Seal.decode(self._read(_SEAL, _HEADER_BYTES))
            seal.check(self._key, data, self._secret)
            manifest = decode_manifest(data)
        if (manifest.name, CacheKey.of_manifest(manifest)) != (name, self._key):
            raise CacheMissError("the entry is of another build")
        _check_outputs(manifest)
        return data, manifest

    def extract(self, entry: OutputEntry, target: BinaryIO) -> None:
        """Write the next output, which ``entry`` of the manifest describes, to ``target``.

        Raises:
            CacheMissError: It differs from its description.
        """
        digest = hashlib.sha256()
        for chunk in self._chunks(entry):
            digest.update(chunk)
            target.write(chunk)
        if digest.hexdigest() != entry.sha256:
            raise CacheMissError(f"the entry is damaged: {entry.name} has another digest")

    def _chunks(self, entry: OutputEntry) -> Iterator[bytes]:
        with _damage_reported():
            content = self._open(entry.name, entry.size)
            while chunk := content.read(_CHUNK):
                yield chunk

    def _read(self, name: str, max_bytes: int) -> bytes:
        return self._open(name, max_bytes, is_exact=False).read()

    def _open(self, name: str, size: int, is_exact: bool = True) -> IO[bytes]:
        """Open the next member, if it is a file of this name and size, or at most of this size."""
        self._source.allow(0)
        member = self._archive.next()
        fits = member and (member.size == size if is_exact else member.size <= size)
        is_file = member and member.type == tarfile.REGTYPE and not member.issparse()
        if member is None or member.name != name or not (fits and is_file):
            raise ValueError(f"{name} is missing, or has another size")
        self._source.allow(member.size)
        content = self._archive.extractfile(member)
        assert content is not None  # only of links and folders
        return content


@dataclass(frozen=True, slots=True)
class _Seal:
    """The digests that show whether a manifest is whole, and by whom it was stored.

    Attributes:
        sha256: Of key and manifest: shows damage.
        hmac: HMAC-SHA256 of the same, with the user's key: shows where it comes from; empty if the
            archive is not signed.
    """

    sha256: str
    hmac: str

    @classmethod
    def of(cls, key: CacheKey, manifest: bytes, secret: bytes | None) -> Self:
        data = f"fire-atlas cache {key.digest}\n".encode() + manifest
        signature = hmac.new(secret, data, hashlib.sha256).hexdigest() if secret else ""
        return cls(hashlib.sha256(data).hexdigest(), signature)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        match json.loads(data):
            case {"sha256": str(sha256), "hmac-sha256": str(signature)}:
                return cls(sha256, signature)
        raise ValueError("it has no valid seal")

    def encode(self) -> bytes:
        return json.dumps({"sha256": self.sha256, "hmac-sha256": self.hmac}).encode()

    def check(self, key: CacheKey, manifest: bytes, secret: bytes | None) -> None:
        """Raise if the manifest is damaged, or not signed with ``secret`` if one is given."""
        expected = self.of(key, manifest, secret)
        if self.sha256 != expected.sha256:
            raise ValueError("its manifest has another digest")
        if secret and not self.hmac:
            raise SignatureError("the entry is not signed, and FIRE_ATLAS_CACHE_KEY is set")
        if secret and not hmac.compare_digest(self.hmac.encode(), expected.hmac.encode()):
            raise SignatureError("the entry is signed with another key than FIRE_ATLAS_CACHE_KEY")


def _check_outputs(manifest: Manifest) -> None:
    """Raise if the outputs have names that no build gives, or are too large."""
    names = [entry.name for entry in manifest.outputs]
    for name in names:
        if not is_portable(name) or is_reserved(name):
            raise CacheMissError(f"the entry has a file that no build would write: {name}")
    if len({as_file_name(name) for name in names}) < len(names):
        raise CacheMissError("the entry has a file twice")
    if sum(entry.size for entry in manifest.outputs) > _MAX_BYTES:
        raise CacheMissError(f"the entry is larger than {_MAX_BYTES // MIB} MiB")


@contextmanager
def _damage_reported() -> Iterator[None]:
    """Turn what a parser raises for damaged data into a ``CacheMissError``."""
    try:
        yield
    except (tarfile.TarError, ValueError, OverflowError, EOFError, RecursionError) as error:
        raise CacheMissError(f"the entry is damaged: {error}") from error


class _LimitedStream(io.RawIOBase):
    """A stream that ends with an error if more is read of it than was allowed."""

    def __init__(self, source: Readable) -> None:
        super().__init__()
        self._source = source
        self._left = 0

    def allow(self, size: int) -> None:
        """Allow to read a member's content of ``size`` bytes, with what surrounds it."""
        self._left = size + _HEADER_BYTES

    def read(self, size: int = -1, /) -> bytes:
        """Read at most ``size`` bytes."""
        data = self._source.read(size)
        self._left -= len(data)
        if self._left < 0:
            raise ValueError("it is longer than its manifest states")
        return data
