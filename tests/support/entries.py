"""Entries of a cache, taken apart and made anew with seals that hold: anyone can who may write."""

import hashlib
import io
import json
import tarfile
from pathlib import Path
from typing import Any


def taken_apart(entry: Path) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Return the manifest of an entry, and its outputs by their names."""
    with tarfile.open(entry) as archive:
        manifest, _, *outputs = archive.getmembers()
        return json.loads(_read(archive, manifest)), {
            each.name: _read(archive, each) for each in outputs
        }


def _read(archive: tarfile.TarFile, member: tarfile.TarInfo) -> bytes:
    content = archive.extractfile(member)
    assert content is not None
    return content.read()


def forge(entry: Path, manifest: Any, outputs: list[tuple[tarfile.TarInfo, bytes]]) -> None:
    """Write an unsigned entry, sealed for the key that the name of the file ``entry`` is.

    ``manifest`` is written as JSON, or as it is if it is bytes.
    """
    data = manifest if isinstance(manifest, bytes) else json.dumps(manifest).encode()
    name = manifest.get("name") if isinstance(manifest, dict) else None
    digest = hashlib.sha256(f"fire-atlas cache {entry.stem}\n".encode() + data).hexdigest()
    seal = json.dumps({"sha256": digest, "hmac-sha256": ""}).encode()
    with tarfile.open(entry, "w", format=tarfile.PAX_FORMAT) as archive:
        stem = name if isinstance(name, str) and name.isprintable() else "fire"
        for each, content in ((f"{stem}.manifest.json", data), (".seal", seal)):
            archive.addfile(header(each, len(content)), io.BytesIO(content))
        for member, content in outputs:
            archive.addfile(member, io.BytesIO(content))


def header(name: str, size: int, type_: bytes = tarfile.REGTYPE) -> tarfile.TarInfo:
    """Return the header of a member of an archive."""
    made = tarfile.TarInfo(name)
    made.size, made.type = size, type_
    return made


def described(name: str, role: str, data: bytes) -> dict[str, Any]:
    """Return how a manifest describes an output."""
    return {
        "path": name,
        "role": role,
        "bytes": len(data),
        "sha256": hashlib.sha256(data).hexdigest(),
    }
