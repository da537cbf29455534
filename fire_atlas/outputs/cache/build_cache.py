"""Take builds from a cache and store them in it. Whatever is wrong with it, a build goes on."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fire_atlas.outputs.cache.archive import (
    ArchiveReader,
    CacheMissError,
    SignatureError,
    is_too_large,
    write_archive,
)
from fire_atlas.outputs.cache.key import CacheKey
from fire_atlas.outputs.cache.store import StoreError, open_store
from fire_atlas.outputs.manifest import Manifest, read_manifest

NOT_READ, NOT_WRITTEN = "building without it", "builds are not stored"
"""Ends of the notes about a store that has failed and is not tried again."""


@dataclass(slots=True)
class BuildCache:
    """A cache that is used by the builds of one process.

    A store that fails is not tried again, so that the user reads of it once and waits for it once.

    Attributes:
        location: A folder, or a URL.
        writes: Whether builds are stored in it; False once that has failed.
        secret: Key that entries are signed with; None if they need no signature.
        reads: Whether builds are taken from it; False once that has failed.
    """

    location: str
    writes: bool = True
    secret: bytes | None = None
    reads: bool = True

    @contextmanager
    def entry(self, key: CacheKey, note: Callable[[str], None]) -> Iterator[ArchiveReader]:
        """Open the entry of a build for reading.

        ``note`` is called with a sentence about what the user should know, even without ``-v``.

        Raises:
            CacheMissError: There is none, or while it is read it turns out that it cannot be used.
        """
        if not self.reads:
            raise CacheMissError("the cache is not used any more")
        try:
            store = open_store(self.location)
            with store.open(key.digest) as source:
                if source is None:
                    raise CacheMissError("no entry")
                yield ArchiveReader(source, key, self.secret)
            if self.writes:
                store.touch(key.digest)
        except SignatureError as error:
            note(f"cache: {error}; building instead")
            raise
        except StoreError as error:
            self.reads = self.writes = False
            note(f"cache: {error}; {NOT_READ}")
            raise CacheMissError("the cache cannot be read") from error

    def store(
        self, out: Path, name: str, merged: bool, note: Callable[[str], None]
    ) -> tuple[str, str]:
        """Store the build ``name``, whose outputs are in ``out``.

        Args:
            out: The output folder.
            name: Name of the build.
            merged: Whether files that were there have shaped the outputs, which are not stored
                then: the next machine has other ones, or none.
            note: Called with a sentence if the cache cannot be written.

        Returns:
            "stored" or "not stored", and the key or the reason.
        """
        manifest = read_manifest(out, name)
        if merged:
            return "not stored", "an engine's files that were there were merged into the outputs"
        if manifest is None or not _is_current(manifest, out):
            return "not stored", "files have changed since the build began"
        if is_too_large(manifest, out):
            return "not stored", "no entry may be so large"
        key = CacheKey.of_manifest(manifest)
        try:
            open_store(self.location).write(
                key.digest, lambda target: write_archive(target, out, name, self.secret)
            )
        except StoreError as error:
            self.writes = False
            note(f"cache: {error}; {NOT_WRITTEN}")
            return "not stored", str(error)
        return "stored", str(key)


def _is_current(manifest: Manifest, out: Path) -> bool:
    """Return whether no input changed during a build, and no output since."""
    has_digests = all(entry.sha256 for entry in manifest.inputs)
    return has_digests and all(entry.is_intact(out) for entry in manifest.outputs)
