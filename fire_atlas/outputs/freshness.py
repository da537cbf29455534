"""Find out whether the outputs of an earlier build are stale, and why."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from fire_atlas.core.cpu import cpu_class
from fire_atlas.outputs.dependencies import dependencies_of, inputs_of
from fire_atlas.outputs.digest import file_digest, request_digest, tool_digest
from fire_atlas.outputs.manifest import (
    InputEntry,
    OutputEntry,
    input_path,
    manifest_name,
    read_manifest,
)
from fire_atlas.recipe.tree import RecipeTree


def why_stale(tree: RecipeTree, out: Path) -> str | None:
    """Return why the outputs of ``tree`` in ``out`` are stale; None if they are up to date.

    Raises:
        SourceError: The source is missing, or lacks frames that the recipe uses.
    """
    manifest = read_manifest(out, tree.name)
    if manifest is None:
        return f"{out} holds no valid {manifest_name(tree.name)}"
    if manifest.request_digest != request_digest(tree):
        return "the recipe has changed"
    if manifest.tool_digest != tool_digest():
        return "fire-atlas or one of its libraries has another version"
    reason = _why_inputs_differ(manifest.inputs, inputs_of(tree), tree.path.parent)
    return reason or _why_outputs_differ(manifest.outputs, out)


def refresh_time(tree: RecipeTree, out: Path) -> None:
    """Give the manifest of up-to-date outputs the time of the newest input, if that is newer.

    make and ninja compare times. Without this, an input that was touched but has the same content
    would have them run a build that does nothing again and again.
    """
    manifest = out / manifest_name(tree.name)
    # A folder that cannot be written to is no error: nothing has to be built.
    with suppress(OSError):
        newest = max(path.stat().st_mtime_ns for path in dependencies_of(tree, out))
        # An input that changed since it was compared must not seem older than the outputs.
        if newest > manifest.stat().st_mtime_ns and why_stale(tree, out) is None:
            os.utime(manifest, ns=(newest, newest))


def why_other_bytes(out: Path, name: str) -> str | None:
    """Return why the up-to-date outputs of the build ``name`` may differ in the last digits from
    those that this machine would write; None if they cannot.
    """
    manifest = read_manifest(out, name)
    built_on = manifest and manifest.statistics.get("cpu")
    if built_on == cpu_class():
        return None
    return f"it was built on a CPU of class {built_on}, and this one is {cpu_class()}"


def _why_inputs_differ(
    before: Sequence[InputEntry], inputs: Sequence[Path], folder: Path
) -> str | None:
    names = [input_path(path, folder) for path in inputs]
    if names != [entry.path for entry in before]:
        return f"the inputs differ: {_first_difference(before, names)}"
    for path, entry in zip(inputs, before, strict=True):
        if not _is_unchanged(path, entry.sha256):
            return f"{entry.path} has changed"
    return None


def _first_difference(before: Sequence[InputEntry], names: Sequence[str]) -> str:
    """Return which input is new or gone, or that only their order differs."""
    known, found = {entry.path for entry in before}, set(names)
    for name in names:
        if name not in known:
            return f"{name} is new"
    for entry in before:
        if entry.path not in found:
            return f"{entry.path} is gone"
    return "in another order"


def _is_unchanged(path: Path, sha256: str) -> bool:
    """Return whether a file has this SHA-256; False if it cannot be read: a build says why."""
    try:
        return file_digest(path) == sha256
    except OSError:
        return False


def _why_outputs_differ(outputs: Sequence[OutputEntry], out: Path) -> str | None:
    for entry in outputs:
        if not _is_current(entry, out):
            return f"{out / entry.name} is missing or was changed"
    return None


def _is_current(entry: OutputEntry, out: Path) -> bool:
    """Return whether an output is current. Import settings may be edited: engines do that."""
    return (out / entry.name).is_file() if entry.role == "import" else entry.is_intact(out)
