"""Write the outputs of a build but its images: the files that describe them, and the manifest."""

from collections.abc import Iterable, Mapping
from typing import Any

from fire_atlas.atlas.sheet import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.product import Product
from fire_atlas.outputs.digest import HashedFile, request_digest, text_digest
from fire_atlas.outputs.manifest import (
    InputEntry,
    Manifest,
    OutputEntry,
    encode_manifest,
    manifest_name,
)
from fire_atlas.outputs.ownership import FolderManifests, refuse_replacing
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.animation.contribution import FinishedAnimation
from fire_atlas.pipeline.files.expected import expected_outputs
from fire_atlas.recipe.load import LoadedRecipe
from fire_atlas.recipe.models import Recipe


def refuse_taken_names(recipe: Recipe, staging: Staging) -> None:
    """Refuse a build that would replace files of the user or of another build, before it starts.

    Raises:
        OutputError: The name of an output that is known already is taken.
    """
    expected = list(expected_outputs(recipe))
    for name, _ in expected:
        staging.refuse(name)
    refuse_replacing(FolderManifests.read(staging.out, recipe.name), expected, staging.overwrite)


def write_files(files: Iterable[OutputFile], staging: Staging) -> list[OutputEntry]:
    """Write files one by one as they are made."""
    return [_write(file, staging) for file in files]


def _write(file: OutputFile, staging: Staging) -> OutputEntry:
    with staging.open(file.name) as target:
        target.write(file.data)
    return staging.entry(file.name, file.role)


def write_manifest(
    loaded: LoadedRecipe,
    tool_digest: str,
    inputs: Iterable[HashedFile],
    outputs: Iterable[OutputEntry],
    statistics: dict[str, Any],
    staging: Staging,
) -> OutputEntry:
    """Write the manifest, which lists the inputs and outputs of the build.

    Args:
        loaded: The recipe.
        tool_digest: Digest of the tool, taken before the outputs were made.
        inputs: Files that were read.
        outputs: Files that were written.
        statistics: Figures about the result.
        staging: Where the manifest is written.
    """
    resolved = (loaded.recipe, *(member.recipe for member in loaded.members))
    manifest = Manifest(
        name=loaded.recipe.name,
        request_digest=request_digest(loaded.tree),
        recipe_digest=text_digest("\n".join(recipe.model_dump_json() for recipe in resolved)),
        tool_digest=tool_digest,
        inputs=tuple(InputEntry.of(file, loaded.base) for file in inputs),
        outputs=tuple(outputs),
        statistics=statistics,
    )
    name = manifest_name(loaded.recipe.name)
    return _write(OutputFile(name, "manifest", encode_manifest(manifest)), staging)


def product_of(
    sheets: tuple[AtlasSheet, ...],
    animations: Mapping[str, FinishedAnimation],
    loaded: LoadedRecipe,
    staging: Staging,
) -> Product:
    """Return the result of a build for exporters and track writers.

    Args:
        sheets: The atlas in each scale.
        animations: By their names on the pages.
        loaded: The recipe, with its members.
        staging: Reads the files that are in the output folder already.
    """
    sets = {name: animation.tracks for name, animation in animations.items() if animation.tracks}
    lights = {
        name: animation.light
        for name, animation in animations.items()
        if animation.light is not None
    }
    baked = frozenset(name for name in sets if animations[name].bakes_flakes)
    pixel_art = all(animation.pixel_art for animation in animations.values())
    track_formats = loaded.recipe.tracks
    cameras = {
        name: animation.camera
        for name, animation in animations.items()
        if animation.camera is not None
    }
    return Product(
        sheets,
        {name: first for name, (first, *_) in sets.items()},
        baked,
        staging.existing,
        track_formats,
        lights,
        pixel_art,
        cameras,
        {name: others for name, (_, *others) in sets.items()},
    )
