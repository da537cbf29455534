"""Write images as compressed textures with mip levels, and measure what compression changes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fire_atlas.atlas.deep import as_bytes
from fire_atlas.atlas.gpu import is_srgb, mip_levels
from fire_atlas.core.context import BuildContext
from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.blocks import FORMATS, BlockFormat, decode_blocks
from fire_atlas.formats.textures.encode import Content, encode_images
from fire_atlas.formats.textures.error import TextureError, colour_texture_error, data_error
from fire_atlas.formats.textures.gpu_texture import TextureHeader, level_sizes
from fire_atlas.formats.textures.ktx2 import supercompressed
from fire_atlas.formats.textures.texture_file import write_texture
from fire_atlas.outputs.manifest import OutputEntry
from fire_atlas.outputs.staging import Staging
from fire_atlas.pipeline.pages.layout import Image
from fire_atlas.recipe.output import Atlas

_SEEN_BELOW = 36.0
"""Peak signal-to-noise ratio, dB, under which the error of a compressed texture is seen."""


def write_textures(
    image: Image, drawn: Bytes, atlas: Atlas, staging: Staging, context: BuildContext
) -> tuple[list[OutputEntry], dict[str, TextureError]]:
    """Write the compressed textures of an image that has some.

    Returns:
        Entries of the textures, and how far each is from the image, by their names.
    """
    drawn = _in_four_channels(as_bytes(drawn))
    if image.has_cover and atlas.alpha == "additive":
        atlas = atlas.model_copy(update={"alpha": "premultiplied"})
    count, workers = image.textures[0].levels, context.workers
    levels = list(mip_levels(drawn, count, atlas, workers, is_data=image.is_data))
    formats = [FORMATS[blocks] for blocks in dict.fromkeys(each.blocks for each in image.textures)]
    encoded = encode_images(
        levels, formats, _is_srgb(image, atlas), workers,
        quality=atlas.gpu_quality, content=_content(image, atlas),
    )  # fmt: skip
    headers = [_header(format_, image, levels, atlas) for format_ in formats]
    of_blocks = {
        header.format.name: (header, data, _error(header, data[0], image, drawn, atlas, workers))
        for header, data in zip(headers, encoded, strict=True)
    }
    outputs, errors = [], dict[str, TextureError]()
    for texture in image.textures:
        header, data, errors[texture.file] = of_blocks[texture.blocks]
        if atlas.supercompression == "zstd" and texture.file.endswith(".ktx2"):
            header = replace(header, supercompression="zstd")
            data = supercompressed(data, atlas.gpu_quality == "final", workers)
        with staging.open(texture.file) as file:
            write_texture(file, texture.file, header, data)
        outputs.append(staging.entry(texture.file, "texture"))
    return outputs, errors


def _in_four_channels(image: Bytes) -> Bytes:
    """Return an image (H, W) or (H, W, 4) as one of four channels: its values are red."""
    if image.ndim == 3:
        return image
    empty = np.zeros_like(image)
    return np.dstack([image, empty, empty, np.full_like(image, 255)])


def _error(
    header: TextureHeader,
    encoded: bytes,
    image: Image,
    drawn: Bytes,
    atlas: Atlas,
    workers: Workers,
) -> TextureError:
    """Return how far the first level of a texture is from the image."""
    size = header.width, header.height
    decoded = decode_blocks(encoded, *size, header.format, header.srgb, workers)
    if image.is_data:
        is_heat = image.role == "page"
        return data_error(decoded, drawn, image.channels, workers, is_heat=is_heat)
    return colour_texture_error(decoded, drawn, atlas.alpha, atlas.blend_space, workers)


def _header(
    format_: BlockFormat, image: Image, levels: Sequence[Bytes], atlas: Atlas
) -> TextureHeader:
    """Return what a texture's file says of it."""
    height, width = levels[0].shape[:2]
    is_straight = image.is_data or atlas.alpha == "straight"
    return TextureHeader(
        format=format_,
        width=width,
        height=height,
        srgb=_is_srgb(image, atlas),
        alpha="opaque" if format_.channels < 4 else "straight" if is_straight else "premultiplied",
        sizes=level_sizes(format_, width, height, len(levels)),
    )


def _content(image: Image, atlas: Atlas) -> Content:
    if image.is_data:
        return "data"
    return "straight" if atlas.alpha == "straight" else "premultiplied"


def _is_srgb(image: Image, atlas: Atlas) -> bool:
    return is_srgb(atlas) and not image.is_data


def note_texture_errors(
    errors: Mapping[str, TextureError], atlas: Atlas, context: BuildContext
) -> None:
    """Note which of these textures has the largest error, if that can be seen; of drafts only that
    they are such."""
    if atlas.gpu_quality == "draft":
        context.progress.note(
            "atlas.gpu_quality: draft: compressed textures are encoded fast, and lose more than "
            "those of final: to look at, not to ship"
        )
        return
    name, worst = min(errors.items(), key=lambda item: item[1].psnr)
    if worst.psnr >= _SEEN_BELOW:
        return
    advice = (
        "alpha: premultiplied loses less"
        if atlas.alpha == "straight"
        else "bc7 and astc-4x4 lose least; pixel art and dithered art are better left uncompressed"
    )
    context.progress.note(
        f"atlas.gpu: {name} differs from its image by {worst.psnr:.1f} dB, which can be seen: "
        f"{advice}"
    )
