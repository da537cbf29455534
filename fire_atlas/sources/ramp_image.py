"""Read a ramp from an image: a gradient that an artist painted."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import has_transparency, to_light
from fire_atlas.core.workload import MAX_PIXELS
from fire_atlas.sources.header import Header
from fire_atlas.sources.images import decode, detect_format, read_header
from fire_atlas.sources.matte import luminance_of_light


def read_ramp(
    path: Path, entries: int, blend_space: str, max_pixels: int = MAX_PIXELS
) -> NDArray[np.float32]:
    """Return the row in the middle of an image as so many entries of light, (entries, 4).

    Without any transparency, what is black in it is empty: its coverage is its luminance.

    Raises:
        SourceError: It is not an image, broken, too large, or a single px wide.
    """
    picture = decode(path, examine_ramp(path, max_pixels))
    row = np.ascontiguousarray(picture[picture.shape[0] // 2][None])
    light = to_light(row)
    if not has_transparency(row):
        light = luminance_of_light(light, blend_space)
    at = np.linspace(0, light.shape[1] - 1, entries)
    columns = [np.interp(at, np.arange(light.shape[1]), light[0, :, i]) for i in range(4)]
    return np.column_stack(columns).astype(np.float32)


def examine_ramp(path: Path, max_pixels: int = MAX_PIXELS) -> Header:
    """Return the header of the image of a ramp.

    Raises:
        SourceError: It is not an image, too large, or a single px wide.
    """
    if detect_format(path) == "video":
        raise SourceError(f"{path}: is a video, but a ramp is an image")
    header = read_header(path, max_pixels)
    if header.width < 2:
        raise SourceError(f"{path}: is 1 px wide; a ramp goes from cold on its left to hot")
    return header
