"""Write what was made: pages, the files that describe them, and the manifest."""

from collections.abc import Iterable, Mapping, Sequence

from fire_atlas.atlas.layout import AtlasSheet
from fire_atlas.core.output_file import OutputFile
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.formats.product import Product
from fire_atlas.outputs.manifest import Output
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.contribution import FinishedAnimation
from fire_atlas.pipeline.pages import Image
from fire_atlas.recipe.output import Atlas, TrackName


def write_images(
    images: Sequence[Image], atlas: Atlas, staging: Staging, context: BuildContext
) -> list[Output]:
    """Draw and write one image after the other, so that only one is in memory."""
    context.progress.stage("write", len(images))
    outputs = []
    for name, role, draw in images:
        with staging.open(name) as file:
            write_page(file, draw(), atlas, context.workers)
        outputs.append(Output(name, role, staging.path(name)))
        context.progress.advance()
    return outputs


def write_files(files: Iterable[OutputFile], staging: Staging) -> list[Output]:
    """Write files as they are made."""
    return [write_file(file, staging) for file in files]


def write_file(file: OutputFile, staging: Staging) -> Output:
    """Write one file."""
    with staging.open(file.name) as target:
        target.write(file.data)
    return Output(file.name, file.role, staging.path(file.name))


def product_of(
    sheets: tuple[AtlasSheet, ...],
    animations: Mapping[str, FinishedAnimation],
    track_formats: tuple[TrackName, ...],
    staging: Staging,
) -> Product:
    """Return what was made, as writers see it.

    Args:
        sheets: The atlas in each scale.
        animations: By their names on the pages.
        track_formats: In which flakes are written.
        staging: Knows the files that lie where the outputs will go.
    """
    tracks = {name: each.tracks for name, each in animations.items() if each.tracks is not None}
    lights = {name: each.light for name, each in animations.items() if each.light is not None}
    baked = frozenset(name for name in tracks if animations[name].bakes_flakes)
    return Product(sheets, tracks, baked, staging.existing, track_formats, lights)
