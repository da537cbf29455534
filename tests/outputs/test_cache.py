"""Entries of a cache: what is stored comes back, and nothing else does, whoever wrote the entry."""

import hashlib
import io
import json
import os
import sys
import tarfile
import threading
import tracemalloc
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fire_atlas.core.cpu import cpu_class
from fire_atlas.outputs.cache.archive import (
    ArchiveReader,
    CacheMissError,
    SignatureError,
    write_archive,
)
from fire_atlas.outputs.cache.build_cache import BuildCache
from fire_atlas.outputs.cache.key import CacheKey
from fire_atlas.outputs.cache.store import open_store
from fire_atlas.outputs.manifest import (
    InputEntry,
    Manifest,
    OutputEntry,
    encode_manifest,
)

FILES = {"fire.png": b"p" * 3000, "fire.json": b"{}", "fire_flakes.tres": b"t" * 700}
INPUTS = (InputEntry("clip/0.png", "ab" * 32), InputEntry("clip/1.png", "cd" * 32))


def described(name: str, data: bytes) -> OutputEntry:
    return OutputEntry(name, "page", len(data), hashlib.sha256(data).hexdigest())


def manifest_of(files: dict[str, bytes], **changes: Any) -> Manifest:
    outputs = tuple(described(*file) for file in files.items())
    made = Manifest("fire", "11", "22", "33", INPUTS, outputs, {"cpu": cpu_class()})
    return replace(made, **changes)


KEY = CacheKey.of_manifest(manifest_of(FILES))


def archive(
    folder: Path, files: dict[str, bytes], secret: bytes | None = None, **changes: Any
) -> bytes:
    """Return the archive of a build that wrote ``files``, which it lists as they are."""
    folder.mkdir(exist_ok=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    (folder / "fire.manifest.json").write_bytes(encode_manifest(manifest_of(files, **changes)))
    target = io.BytesIO()
    write_archive(target, folder, "fire", secret)
    return target.getvalue()


def forged(
    outputs: tuple[OutputEntry, ...],
    members: list[tuple[tarfile.TarInfo, bytes]],
    signature: str = "",
) -> bytes:
    """Return an archive whose manifest lists ``outputs``, and that holds ``members``."""
    data = encode_manifest(manifest_of({}, outputs=outputs))
    digest = hashlib.sha256(f"fire-atlas cache {KEY.digest}\n".encode() + data).hexdigest()
    seal = json.dumps({"sha256": digest, "hmac-sha256": signature}).encode()
    target = io.BytesIO()
    with tarfile.open(fileobj=target, mode="w") as made:
        for name, content in (("fire.manifest.json", data), (".seal", seal)):
            made.addfile(member(name, len(content)), io.BytesIO(content))
        for header, content in members:
            made.addfile(header, io.BytesIO(content))
    return target.getvalue()


def member(name: str, size: int, **changes: Any) -> tarfile.TarInfo:
    header = tarfile.TarInfo(name)
    header.size = size
    for attribute, value in changes.items():
        setattr(header, attribute, value)
    return header


def read(
    data: bytes | io.RawIOBase,
    secret: bytes | None = None,
    key: CacheKey = KEY,
) -> dict[str, bytes]:
    """Return the files in an archive."""
    source = io.BytesIO(data) if isinstance(data, bytes) else data
    reader = ArchiveReader(source, key, secret)
    _, manifest = reader.read_manifest("fire")
    found = {}
    for entry in manifest.outputs:
        target = io.BytesIO()
        reader.extract(entry, target)
        found[entry.name] = target.getvalue()
    return found


def test_what_is_stored_comes_back(tmp_path: Path) -> None:
    assert read(archive(tmp_path, FILES)) == FILES


def test_long_and_foreign_names_and_empty_files_come_back(tmp_path: Path) -> None:
    files = {f"fire.{'x' * 150}.txt": b"long", "fire.火.png": b"", "fire.json": b"{}"}
    assert read(archive(tmp_path, files)) == files


def test_equal_builds_have_equal_archives(tmp_path: Path) -> None:
    assert archive(tmp_path / "a", FILES, b"key") == archive(tmp_path / "b", FILES, b"key")


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return archive(tmp_path_factory.mktemp("stored"), FILES, b"key")


@given(data=st.data())
def test_damage_anywhere_gives_the_right_bytes_or_a_miss(
    stored: bytes, data: st.DataObject
) -> None:
    at = data.draw(st.integers(0, len(stored) - 1))
    length = data.draw(st.integers(0, 600))
    noise = data.draw(st.binary(max_size=600))
    for damaged in (stored[:at], stored[:at] + noise + stored[at + length :]):
        with suppress(CacheMissError):
            assert read(damaged) == FILES


@given(noise=st.binary(max_size=2000))
def test_noise_is_a_miss(noise: bytes) -> None:
    with pytest.raises(CacheMissError, match="damaged"):
        read(noise)


def test_a_flipped_bit_of_any_output_or_of_the_manifest_is_a_miss(stored: bytes) -> None:
    for wanted in (
        b"p" * 64,
        b"t" * 64,
        b'"statistics"',
        b"x86-64" if b"x86-64" in stored else b"{}",
    ):
        at = stored.index(wanted)
        damaged = stored[:at] + bytes([stored[at] ^ 1]) + stored[at + 1 :]
        with pytest.raises(CacheMissError, match="damaged"):
            read(damaged)


CHANGES: dict[str, Any] = {
    "request_digest": "44",
    "tool_digest": "44",
    "inputs": INPUTS[:1],
    "statistics": {"cpu": "vax"},
}


@pytest.mark.parametrize("field", CHANGES)
def test_an_entry_of_another_build_is_a_miss(tmp_path: Path, field: str) -> None:
    other = archive(tmp_path, FILES, **{field: CHANGES[field]})
    with pytest.raises(CacheMissError):
        read(other)
    their = CacheKey.of_manifest(manifest_of(FILES, **{field: CHANGES[field]}))
    assert their.digest != KEY.digest
    assert read(other, key=their) == FILES


def test_an_input_counts_by_its_name_its_content_and_its_place() -> None:
    def digest(*inputs: tuple[str, str]) -> str:
        entries = tuple(InputEntry(*each) for each in inputs)
        return CacheKey.of_manifest(manifest_of(FILES, inputs=entries)).digest

    a, b = ("a.png", "01"), ("b.png", "02")
    others = [(b, a), (a,), (("c.png", "01"), b), (("a.png", "03"), b), (a, b, b)]
    assert len({digest(a, b), *(digest(*each) for each in others)}) == 6


def test_a_signed_entry_is_read_with_its_key_and_without_one(stored: bytes) -> None:
    assert read(stored, b"key") == FILES
    assert read(stored) == FILES


def test_with_a_key_unsigned_and_wrongly_signed_entries_are_misses(
    tmp_path: Path, stored: bytes
) -> None:
    with pytest.raises(SignatureError, match="not signed"):
        read(archive(tmp_path, FILES), b"key")
    with pytest.raises(SignatureError, match="another key"):
        read(stored, b"other")
    with pytest.raises(CacheMissError):
        read(stored.replace(b"p" * 3000, b"q" * 3000), b"key")


def test_a_signature_holds_for_one_manifest_only(stored: bytes) -> None:
    with tarfile.open(fileobj=io.BytesIO(stored)) as honest:
        seal = honest.extractfile(".seal")
        assert seal is not None
        signature = json.loads(seal.read())["hmac-sha256"]
    evil = forged((described("fire.png", b"evil"),), [(member("fire.png", 4), b"evil")], signature)
    assert read(evil) == {"fire.png": b"evil"}  # who has no key believes it
    with pytest.raises(SignatureError, match="another key"):
        read(evil, b"key")


def sized(name: str, size: int) -> OutputEntry:
    return OutputEntry(name, "page", size, "00" * 32)


@pytest.mark.parametrize(
    "name",
    ["../fire.png", "/etc/fire.png", "a/fire.png", "..\\fire.png", "C:fire.png", "..", ".bashrc",
     "fire\n.png", "nul", "other.manifest.json", "fire.manifest.json"],
)  # fmt: skip
def test_names_that_lead_elsewhere_or_are_reserved_are_refused(name: str) -> None:
    with pytest.raises(CacheMissError):
        read(forged((described(name, b"x"),), [(member(name, 1), b"x")]))


@pytest.mark.parametrize("other", ["fire.png", "FIRE.png", "fire.PNG"])
def test_names_of_one_file_are_refused(other: str) -> None:
    outputs = described("fire.png", b"x"), described(other, b"x")
    with pytest.raises(CacheMissError, match="twice"):
        read(forged(outputs, [(member(each.name, 1), b"x") for each in outputs]))


@pytest.mark.parametrize(
    "header",
    [
        member("fire.jpg", 4),
        member("../fire.png", 4),
        member("fire.png", 3),
        member("fire.png", 5),
        member("fire.png", 0, type=tarfile.SYMTYPE, linkname="/etc/passwd"),
        member("fire.png", 0, type=tarfile.LNKTYPE, linkname="fire.json"),
        member("fire.png", 0, type=tarfile.DIRTYPE),
        member("fire.png", 4, type=tarfile.CHRTYPE),
    ],
)
def test_a_member_other_than_the_manifest_states_is_a_miss(header: tarfile.TarInfo) -> None:
    with pytest.raises(CacheMissError, match="damaged"):
        read(forged((described("fire.png", b"data"),), [(header, b"data\0")]))


class Endless(io.RawIOBase):
    """A stream that begins with ``start`` and then never ends."""

    def __init__(self, start: bytes) -> None:
        super().__init__()
        self._start = io.BytesIO(start)
        self.taken = 0

    def read(self, size: int = -1, /) -> bytes:
        assert size >= 0
        data = self._start.read(size) or bytes(size)
        self.taken += len(data)
        return data


@pytest.mark.parametrize("kind", [tarfile.XHDTYPE, tarfile.GNUTYPE_LONGNAME, tarfile.XGLTYPE])
def test_headers_that_never_end_take_no_memory(kind: bytes) -> None:
    huge = member("header", 1 << 40, type=kind).tobuf(tarfile.GNU_FORMAT)
    for source in (
        Endless(huge),
        Endless(forged((sized("fire.png", 1 << 31),), [])[:-10240] + huge),
    ):
        tracemalloc.start()
        with pytest.raises(CacheMissError, match="damaged"):
            read(source)
        assert tracemalloc.get_traced_memory()[1] < 8 << 20
        tracemalloc.stop()
        assert source.taken < 1 << 20


@pytest.mark.parametrize("sizes", [[1 << 33], [1 << 62, 1 << 62], [-1], [1 << 62, -(1 << 62)]])
def test_sizes_beyond_reason_are_misses_before_anything_is_read(sizes: list[int]) -> None:
    outputs = tuple(sized(f"fire{i}.png", size) for i, size in enumerate(sizes))
    source = Endless(forged(outputs, []))
    with pytest.raises(CacheMissError):
        read(source)
    assert source.taken < 1 << 20


def test_a_manifest_of_more_than_8_mib_is_a_miss_before_it_is_read() -> None:
    source = Endless(member("fire.manifest.json", (8 << 20) + 1).tobuf(tarfile.PAX_FORMAT))
    with pytest.raises(CacheMissError, match="another size"):
        read(source)
    assert source.taken < 1 << 20


@pytest.mark.slow
def test_a_manifest_of_8_mib_that_is_made_to_grow_takes_little_memory() -> None:
    lists = b"[" + b"[[]]," * 1_677_000 + b"0]"
    digest = hashlib.sha256(f"fire-atlas cache {KEY.digest}\n".encode() + lists).hexdigest()
    seal = json.dumps({"sha256": digest, "hmac-sha256": ""}).encode()
    target = io.BytesIO()
    with tarfile.open(fileobj=target, mode="w") as made:
        for name, content in (("fire.manifest.json", lists), (".seal", seal)):
            made.addfile(member(name, len(content)), io.BytesIO(content))
    tracemalloc.start()
    with pytest.raises(CacheMissError, match="damaged"):
        read(target.getvalue())
    assert tracemalloc.get_traced_memory()[1] < 400 << 20
    tracemalloc.stop()


def test_who_reads_while_others_write_sees_whole_entries(tmp_path: Path) -> None:
    """Three writers and a reader of one entry of a folder, at once."""
    folder, store = tmp_path / "cache", open_store(str(tmp_path / "cache"))
    contents = [archive(tmp_path / str(i), {"fire.png": bytes([i]) * 200_000}) for i in range(3)]

    def write(data: bytes, times: int = 40) -> None:
        def fill(target: BinaryIO) -> None:
            target.write(data)

        for _ in range(times):
            store.write(KEY.digest, fill)

    write(contents[0], times=1)

    writers = [threading.Thread(target=write, args=(data,)) for data in contents]
    for each in writers:
        each.start()
    while any(each.is_alive() for each in writers):
        with store.open(KEY.digest) as source:
            assert source is not None
            assert len(set(read(source.read())["fire.png"])) == 1
    assert [path.name for path in folder.iterdir()] == [f"{KEY.digest}.tar"]


@pytest.mark.skipif(sys.platform == "win32", reason="files that are open can be removed")
def test_an_entry_that_is_removed_while_it_is_read_is_read(tmp_path: Path) -> None:
    store, data = open_store(str(tmp_path / "cache")), archive(tmp_path / "out", FILES)
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache" / f"{KEY.digest}.tar").write_bytes(data)
    with store.open(KEY.digest) as source:
        assert source is not None
        store.remove(KEY.digest)
        assert read(source.read()) == FILES
    with store.open(KEY.digest) as source:
        assert source is None
    store.remove(KEY.digest)  # another process was quicker


def test_drafts_of_killed_processes_are_removed_when_they_are_old(tmp_path: Path) -> None:
    store = open_store(str(tmp_path))
    draft, old = (tmp_path / f".{KEY.digest}.tar.{each * 8}.tmp" for each in ("ab", "cd"))
    for path in (draft, old):
        path.write_bytes(b"half")
    os.utime(old, (0, 0))
    store.remove_drafts()
    assert list(tmp_path.iterdir()) == [draft]
    assert store.entries() == []


def test_a_store_that_fails_is_tried_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    cache, notes = BuildCache(str(tmp_path / "file" / "cache")), list[str]()
    for _ in range(2):
        with pytest.raises(CacheMissError), cache.entry(KEY, notes.append):
            pass
    assert len(notes) == 1
    assert str(tmp_path) in notes[0]
    assert not cache.writes
