"""Take the outputs of a recipe from a cache instead of building them. Imports nothing heavy."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fire_atlas.core.errors import OutputError
from fire_atlas.outputs.cache.archive import ArchiveReader, CacheMissError
from fire_atlas.outputs.cache.build_cache import BuildCache
from fire_atlas.outputs.cache.key import CacheKey
from fire_atlas.outputs.dependencies import files_of
from fire_atlas.outputs.freshness import why_stale
from fire_atlas.outputs.manifest import Manifest, OutputEntry, manifest_name
from fire_atlas.outputs.ownership import commit
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.files.expected import expected_outputs, unexpected
from fire_atlas.pipeline.files.moved import moved_images
from fire_atlas.pipeline.input.check import CheckedRecipe
from fire_atlas.recipe.models import Recipe

_IMAGE_ROLES = {"page", "map", "ramp"}
"""Roles of the images of sheets, which keep the names that engines' editors give them."""

_MERGED_ROLES = {"import", "scene"}
"""Roles of the files in which a build keeps what an engine or a person has written."""


@dataclass(frozen=True, slots=True)
class RestoredBuild:
    """The outputs that were taken from a cache.

    Attributes:
        files: The outputs, the manifest last.
        statistics: Figures about the result, as in the manifest.
    """

    files: tuple[Path, ...]
    statistics: dict[str, Any]


def restore(
    loaded: CheckedRecipe,
    key: CacheKey,
    cache: BuildCache,
    out: Path,
    overwrite: bool,
    note: Callable[[str], None],
) -> RestoredBuild:
    """Write into ``out`` what a build of the recipe would write, from the entry ``key``.

    The files are committed as those of a build are: all or none, and nothing of the user's is
    replaced, unless ``overwrite``.

    Raises:
        CacheMissError: The cache has no entry that can be used, or what it has cannot be written
            here; nothing was written.
        SourceError: An input is missing.
    """
    try:
        return _restored(loaded, key, cache, out, overwrite, note)
    except OutputError as error:  # maybe of a file that a build would not write: that will tell
        raise CacheMissError(error.lines[0]) from error


def _restored(
    loaded: CheckedRecipe,
    key: CacheKey,
    cache: BuildCache,
    out: Path,
    overwrite: bool,
    note: Callable[[str], None],
) -> RestoredBuild:
    name = loaded.recipe.name
    with cache.entry(key, note) as archive, Staging(out, name, note, overwrite) as staging:
        if why_stale(loaded.tree, out) is None:
            raise CacheMissError("another build has written the same outputs")
        staging.protect(files_of(loaded.tree))
        data, manifest = archive.read_manifest(name)
        _refuse_unlike(manifest, loaded.recipe)
        _refuse_merging(manifest, out)
        _refuse_moving(manifest, loaded.recipe, out)
        outputs = [*_extract(archive, manifest, staging), _write_manifest(name, data, staging)]
        written = commit(name, outputs, staging)
    return RestoredBuild(written, manifest.statistics)


def _refuse_unlike(manifest: Manifest, recipe: Recipe) -> None:
    """Raise if an entry has an output that no build of the recipe writes, or lacks one that every
    build writes."""
    outputs = [(entry.name, entry.role) for entry in manifest.outputs]
    for file in unexpected(recipe, outputs):
        raise CacheMissError(f"the entry has a file that this build would not write: {file}")
    for file, role in expected_outputs(recipe):
        if role != "manifest" and (file, role) not in outputs:
            raise CacheMissError(f"the entry lacks {file}")


def _refuse_merging(manifest: Manifest, out: Path) -> None:
    """Raise if a build would merge one of its outputs with a file that is there."""
    for entry in manifest.outputs:
        is_there = entry.role in _MERGED_ROLES and (out / entry.name).exists()
        if is_there and not entry.is_intact(out):
            raise CacheMissError(f"{entry.name} is there and was changed, which a build keeps")


def _refuse_moving(manifest: Manifest, recipe: Recipe, out: Path) -> None:
    """Raise if a build would write one of its images under another name, at which it lies now."""
    images = [entry.name for entry in manifest.outputs if entry.role in _IMAGE_ROLES]
    for file, place in moved_images(images, recipe.exports, out).items():
        raise CacheMissError(f"{file} lies at {place} now, where a build writes it")


def _extract(
    archive: ArchiveReader, manifest: Manifest, staging: Staging
) -> tuple[OutputEntry, ...]:
    for entry in manifest.outputs:
        with staging.open(entry.name) as file:
            archive.extract(entry, file)
    return manifest.outputs


def _write_manifest(name: str, data: bytes, staging: Staging) -> OutputEntry:
    file = manifest_name(name)
    with staging.open(file) as target:
        target.write(data)
    return staging.entry(file, "manifest")
