"""How long compressed textures take, and what they lose.

Run it from the checkout with pages of builds:
``python -m tools.bench.textures [--straight] [--draft] PAGE.png ...``. Prints, for each page and
format, seconds of processor time a megapixel (one level, one worker), and the error that a build
states: of all four channels, or of those that a format has.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from PIL import Image

from fire_atlas.core.pixels import Bytes
from fire_atlas.core.workers import Workers
from fire_atlas.formats.textures.blocks import FORMATS, BlockFormat, decode_blocks
from fire_atlas.formats.textures.encode import Content, encode_images
from fire_atlas.formats.textures.error import colour_texture_error, data_error
from fire_atlas.recipe.gpu import GpuQuality


def measured(
    image: Bytes, format_: BlockFormat, alpha: Content, quality: GpuQuality, workers: Workers
) -> tuple[float, float]:
    """Return seconds a megapixel, and the peak signal-to-noise ratio, dB."""
    height, width = image.shape[:2]
    start = time.process_time()
    ((data,),) = encode_images([image], [format_], False, workers, quality=quality, content=alpha)
    seconds = time.process_time() - start
    decoded = decode_blocks(data, width, height, format_, False, workers)
    if format_.channels == 4:
        error = colour_texture_error(decoded, image, alpha, "srgb", workers)
    else:
        error = data_error(decoded, image, format_.channels, workers, is_heat=True)
    return seconds / (height * width / 1e6), error.psnr


def main() -> None:
    """Print a line for each page and format."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--straight", action="store_true")
    parser.add_argument("--draft", action="store_true")
    parser.add_argument("pages", nargs="+", type=Path)
    given = parser.parse_args()
    alpha: Content = "straight" if given.straight else "premultiplied"
    quality: GpuQuality = "draft" if given.draft else "final"
    with Workers(1) as workers:
        for page in given.pages:
            image = np.asarray(Image.open(page).convert("RGBA"))
            for format_ in FORMATS.values():
                seconds, psnr = measured(image, format_, alpha, quality, workers)
                print(f"{page.name:28} {format_.name:9} {seconds:6.3f} s/Mpx {psnr:6.1f} dB")


if __name__ == "__main__":
    main()
