"""Write the images of pages and maps, also as compressed textures; measure what these change."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fire_atlas.core.context import BuildContext
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.statistics import figures_entry
from fire_atlas.formats.pages.page_file import read_page, write_page
from fire_atlas.formats.pages.png import write_png
from fire_atlas.outputs.manifest import OutputEntry
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.pages.layout import Image
from fire_atlas.recipe.output import Atlas

if TYPE_CHECKING:
    from fire_atlas.formats.pages.colour_error import ColourError
    from fire_atlas.formats.textures.error import TextureError

_SEEN_BELOW = 32.0
"""Peak signal-to-noise ratio, dB, under which the error of a lossy page is easily seen."""


def write_images(
    images: Sequence[Image], atlas: Atlas, staging: Staging, context: BuildContext
) -> tuple[list[OutputEntry], dict[str, Any]]:
    """Draw and write the images one by one, so that only one is in memory.

    Returns:
        Entries of the images and their textures, and the manifest's statistics of those that are
        lossy.
    """
    context.progress.stage("write", len(images))
    outputs = list[OutputEntry]()
    errors: dict[str, ColourError] = {}
    textures: dict[str, TextureError] = {}
    for image in images:
        drawn = image.draw()
        with staging.open(image.name) as file:
            if image.role == "ramp":
                write_png(file, drawn, context.workers)
            else:
                write_page(file, drawn, atlas, context.workers, is_data=image.is_data)
        if atlas.quality != "lossless" and not image.is_data:
            path = staging.path(image.name)
            errors[image.name] = _written_error(path, drawn, atlas, context)
        outputs.append(staging.entry(image.name, image.role))
        if image.textures:
            from fire_atlas.pipeline.files.textures import write_textures

            entries, found = write_textures(image, drawn, atlas, staging, context)
            outputs += entries
            textures.update(found)
        context.progress.advance()
    if errors:
        _note_errors(errors, atlas, context)
    if textures:
        from fire_atlas.pipeline.files.textures import note_texture_errors

        note_texture_errors(textures, atlas, context)
    figures = {**figures_entry("colour_error", errors), **figures_entry("gpu", textures)}
    return outputs, figures | ({"gpu_quality": atlas.gpu_quality} if textures else {})


def _written_error(file: Path, drawn: Bytes, atlas: Atlas, context: BuildContext) -> "ColourError":
    """Return how far the colours in a file are from those that were drawn."""
    from fire_atlas.formats.pages.colour_error import measured_error

    height, width = drawn.shape[:2]
    decoded = context.workers.start(partial(read_page, file, width, height)).result()
    return measured_error(decoded, drawn, atlas.alpha == "straight", context.workers)


def _note_errors(errors: "Mapping[str, ColourError]", atlas: Atlas, context: BuildContext) -> None:
    """Note the image with the largest error."""
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
