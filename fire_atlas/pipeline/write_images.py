"""Write the images of pages and maps, and measure what lossy files change."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.pages.colour_error import ColourError, measured_error
from fire_atlas.formats.pages.page_file import read_page, write_page
from fire_atlas.outputs.manifest import OutputEntry
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.context import BuildContext
from fire_atlas.pipeline.pages import Image
from fire_atlas.recipe.output import Atlas

_SEEN_BELOW = 32.0
"""Peak signal-to-noise ratio, dB, under which the error of a lossy page is easily seen."""


def write_images(
    images: Sequence[Image], atlas: Atlas, staging: Staging, context: BuildContext
) -> tuple[list[OutputEntry], dict[str, ColourError]]:
    """Draw and write the images one by one, so that only one is in memory.

    Returns:
        Entries of the images, and the errors of those that are lossy, by their names.
    """
    context.progress.stage("write", len(images))
    outputs, errors = [], dict[str, ColourError]()
    for image in images:
        drawn = image.draw()
        with staging.open(image.name) as file:
            write_page(file, drawn, atlas, context.workers, is_data=image.is_data)
        if atlas.quality != "lossless" and not image.is_data:
            errors[image.name] = _written_error(staging.path(image.name), drawn, atlas, context)
        outputs.append(OutputEntry.of(image.name, image.role, staging.path(image.name)))
        context.progress.advance()
    _note_errors(errors, atlas, context)
    return outputs, errors


def _written_error(file: Path, drawn: Bytes, atlas: Atlas, context: BuildContext) -> ColourError:
    """Return how far the colours in a file are from those that were drawn."""
    height, width = drawn.shape[:2]
    decoded = context.workers.start(partial(read_page, file, width, height)).result()
    return measured_error(decoded, drawn, atlas.alpha == "straight", context.workers)


def _note_errors(errors: Mapping[str, ColourError], atlas: Atlas, context: BuildContext) -> None:
    """Note the image with the largest error."""
    if not errors:
        return
    name, worst = max(errors.items(), key=lambda item: item[1].rms)
    advice = (
        "; this can be seen: raise atlas.quality, or set it to lossless, which flat colours and "
        "pixel art need"
        if worst.psnr < _SEEN_BELOW
        else ""
    )
    others = f", the worst of {len(errors)} images" if len(errors) > 1 else ""
    context.progress.note(
        f"atlas.quality {atlas.quality}: {name}{others}: {worst.sentence()}{advice}"
    )
