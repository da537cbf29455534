"""Write and read manifests: JSON files that list the inputs and the outputs of a build.

A manifest has no times or absolute paths, and of the machine only the class of its CPU
(``statistics.cpu``), so that equal builds have equal manifests. Imports nothing heavy, because an
up-to-date build only reads the recipe and the manifest and hashes files.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from fire_atlas.core.files import MIB, read_file, real
from fire_atlas.core.output_file import MANIFEST_ENDING, name_below
from fire_atlas.core.version import __version__
from fire_atlas.outputs.digest import HashedFile, file_digest

MAX_MANIFEST_BYTES = 32 * MIB
"""Limit on the size of a manifest that is read: that of 200,000 inputs is smaller."""

_FORMAT, _VERSION = "fire-atlas/manifest", 1


@dataclass(frozen=True, slots=True)
class InputEntry:
    """A file that a build was made from.

    Attributes:
        path: Relative to the recipe's folder, with ``/`` between folders.
        sha256: Of the bytes that were read, as hexadecimal digits; empty if the file changed during
            the build, which makes the build stale.
    """

    path: str
    sha256: str

    @classmethod
    def of(cls, file: HashedFile, folder: Path) -> Self:
        """Return the entry of a file after it was read, for a recipe in ``folder``."""
        return cls(input_path(file.path, folder), file.sha256 if file.is_unchanged() else "")


@dataclass(frozen=True, slots=True)
class OutputEntry:
    """A file that a build wrote.

    Attributes:
        name: File name in the output folder, after the folders in it where it was moved.
        role: What it is for: a ``Role`` of this version of the tool or of another.
        size: In bytes.
        sha256: Of its bytes as they were written, as hexadecimal digits.
    """

    name: str
    role: str
    size: int
    sha256: str

    def is_intact(self, out: Path) -> bool:
        """Return whether the file in ``out`` has the bytes that the build wrote."""
        path = out / self.name
        return (
            path.is_file() and path.stat().st_size == self.size and file_digest(path) == self.sha256
        )


@dataclass(frozen=True, slots=True)
class Manifest:
    """The inputs and outputs of a build.

    Attributes:
        name: Name of the build, the file stem of its outputs.
        request_digest: SHA-256 of the values in the recipe; see ``digest.request_digest``.
        recipe_digest: SHA-256 of the recipe and its members with all their defaults.
        tool_digest: SHA-256 of the code and the libraries; see ``digest.tool_digest``.
        inputs: In playing order, templates last.
        outputs: In the order they were written, without the manifest itself.
        statistics: Figures about the result, as JSON values.
        tool: Name and version of the tool, for people.
    """

    name: str
    request_digest: str
    recipe_digest: str
    tool_digest: str
    inputs: tuple[InputEntry, ...]
    outputs: tuple[OutputEntry, ...]
    statistics: dict[str, Any]
    tool: str = f"fire-atlas {__version__}"


def manifest_name(name: str) -> str:
    """Return the file name of the manifest of the build ``name``."""
    return f"{name}{MANIFEST_ENDING}"


def input_path(path: Path, folder: Path) -> str:
    """Return an input's path as stated in the manifest of a recipe in ``folder``."""
    return Path(os.path.relpath(path, real(folder))).as_posix()


def read_manifest(out: Path, name: str) -> Manifest | None:
    """Return the manifest of the build ``name`` in ``out``, None if there is no valid one."""
    try:
        return decode_manifest(read_file(out / manifest_name(name), MAX_MANIFEST_BYTES))
    except (OSError, ValueError):
        return None


def encode_manifest(manifest: Manifest) -> bytes:
    """Return the manifest as the bytes of its file."""
    document = {
        "format": _FORMAT,
        "version": _VERSION,
        "name": manifest.name,
        "tool": manifest.tool,
        "made_by": manifest.tool_digest,
        "asked": manifest.request_digest,
        "recipe": manifest.recipe_digest,
        "inputs": [{"path": entry.path, "sha256": entry.sha256} for entry in manifest.inputs],
        "outputs": [
            {"path": entry.name, "role": entry.role, "bytes": entry.size, "sha256": entry.sha256}
            for entry in manifest.outputs
        ],
        "statistics": manifest.statistics,
    }
    return (json.dumps(document, indent=1) + "\n").encode()


def decode_manifest(data: bytes) -> Manifest:
    """Return the manifest in the bytes of a file, which are untrusted.

    Raises:
        ValueError: They are not a manifest of this version, or it names a file elsewhere.
    """
    match _parsed(data):
        case {
            "format": format_,
            "version": version,
            "name": str(name),
            "tool": str(tool),
            "made_by": str(tool_digest),
            "asked": str(request_digest),
            "recipe": str(recipe_digest),
            "inputs": list(inputs),
            "outputs": list(outputs),
            "statistics": dict(statistics),
        } if (format_, version) == (_FORMAT, _VERSION):
            return Manifest(
                name=name,
                request_digest=request_digest,
                recipe_digest=recipe_digest,
                tool_digest=tool_digest,
                inputs=tuple(map(_decode_input, inputs)),
                outputs=tuple(map(_decode_output, outputs)),
                statistics=statistics,
                tool=tool,
            )
    raise ValueError("a key is missing or has an invalid value")


def _parsed(data: bytes) -> Any:
    try:
        return json.loads(data)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _decode_input(entry: Any) -> InputEntry:
    match entry:
        case {"path": str(path), "sha256": str(sha256)}:
            return InputEntry(path, sha256)
    raise ValueError(f"{entry!r} is not an input")


def _decode_output(entry: Any) -> OutputEntry:
    match entry:
        case {
            "path": str(name),
            "role": str(role),
            "bytes": int(size),
            "sha256": str(sha256),
        } if size >= 0:
            return OutputEntry(name_below(name), role, size, sha256)
    raise ValueError(f"{entry!r} is not an output")
