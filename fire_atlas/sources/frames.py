"""Source ``frames``: open images, a sheet, an animation or a video as a clip."""

from collections.abc import Sequence
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from fire_atlas.core.clip import Clip
from fire_atlas.core.errors import SourceError
from fire_atlas.core.picture import Picture, brightest, to_light
from fire_atlas.core.pixels import Pixels
from fire_atlas.recipe.source import FramesSource
from fire_atlas.sources import matte
from fire_atlas.sources.animated import open_animation
from fire_atlas.sources.images import ANIMATIONS, check_size, decode, detect_format, read_header
from fire_atlas.sources.listing import MAX_PIXELS, cut, locate
from fire_atlas.sources.reader import FrameReader, cached
from fire_atlas.sources.sheet import open_sheet

DEFAULT_FPS = 24.0
"""Rate of files that state none, frames/s."""
_SAMPLES = 5
"""Frames that are decoded to choose a matte."""


def open_frames(
    settings: FramesSource, path: Path, blend_space: str, most_pixels: int = MAX_PIXELS
) -> Clip:
    """Open the frames at ``path``: headers and a few sample frames are read, no more.

    Args:
        settings: The recipe's ``source``.
        path: Absolute; may be a glob.
        blend_space: ``srgb`` or ``linear``: where the client blends, for the luminance matte.
        most_pixels: Larger pictures are refused.

    Raises:
        SourceError: The input is missing, broken, too large or not what the settings say.
    """
    reader, chosen = _open_reader(settings, path, most_pixels)
    reader = cached(reader)
    inputs = reader.inputs if len(reader.inputs) == 1 else tuple(reader.inputs[i] for i in chosen)
    choice = matte.choose(settings.matte, map(reader.read, sample_numbers(chosen)), str(path))
    height = settings.height or reader.height
    width = width_for(height, (reader.width, reader.height))
    check_size(f"{path} at height {height}", width, height, most_pixels)
    keeps_pixels = settings.sampling == "nearest"

    def shown(i: int) -> Picture:
        picture = _read_checked(reader, path, chosen[i])
        if (width, height) == (reader.width, reader.height):
            return matte.apply(choice.matte, picture, blend_space)
        if keeps_pixels:
            return nearest(matte.apply(choice.matte, picture, blend_space), width, height)
        return _resized(choice.matte, picture, (width, height), blend_space)

    return Clip(
        width=width,
        height=height,
        fps=settings.fps or reader.fps or DEFAULT_FPS,
        count=len(chosen),
        picture=shown,
        inputs=inputs,
        blend_space=blend_space,
        matte=choice.matte,
        matte_reason=choice.reason,
    )


def _read_checked(reader: FrameReader, path: Path, i: int) -> Picture:
    picture = reader.read(i)
    if picture.shape[:2] != (reader.height, reader.width):
        raise SourceError(
            f"{path}: frame {i} is {picture.shape[1]}x{picture.shape[0]}, but the others are "
            f"{reader.width}x{reader.height}; all frames must have one size"
        )
    return picture


def _resized(
    kind: matte.Matte, picture: Picture, size: tuple[int, int], blend_space: str
) -> Pixels:
    """Resize in light first: a luminance matte is then exact for the pixels that result."""
    pixels = resize(to_light(picture), *size)
    if kind == "luminance":
        return matte.luminance_of_light(pixels, blend_space)
    return matte.over_black(pixels) if kind == "none" else pixels


def sample_numbers(chosen: range) -> list[int]:
    """Return a handful of frame numbers, first and last among them, in ascending order."""
    places = np.linspace(0, len(chosen) - 1, min(_SAMPLES, len(chosen)))
    return [chosen[round(float(place))] for place in places]


def _open_reader(settings: FramesSource, path: Path, most_pixels: int) -> tuple[FrameReader, range]:
    """Return the decoded frames at ``path`` and the numbers of those to use."""
    located = locate(path)
    if not located.single:
        if settings.grid is not None:
            raise SourceError(
                f"{path}: grid cuts one image into cells, but this is {len(located.files)} "
                "images; leave grid out, or give one sheet as path"
            )
        chosen = cut(settings, len(located.files), path)
        return _open_images(located.files, chosen, most_pixels), chosen
    reader = _open_file(settings, located.files[0], most_pixels)
    return reader, cut(settings, reader.count, path)


def _open_file(settings: FramesSource, path: Path, most_pixels: int) -> FrameReader:
    kind = detect_format(path)
    if settings.grid is not None:
        if kind in ("video", "gif"):
            raise SourceError(f"{path}: grid cuts one still image into cells; leave it out here")
        return open_sheet(path, settings.grid, most_pixels)
    if kind == "video":
        from fire_atlas.sources.video import open_video

        return open_video(path, settings.fps, most_pixels)
    if kind in ANIMATIONS:
        read_header(path, most_pixels)
        return open_animation(path, kind, settings.fps, most_pixels)
    return _open_images((path,), range(1), most_pixels)


def _open_images(files: Sequence[Path], chosen: range, most_pixels: int) -> FrameReader:
    """Return one frame for each file; the headers of the chosen ones are compared."""
    headers = {i: read_header(files[i], most_pixels) for i in chosen}
    first = headers[chosen[0]]
    for i, header in headers.items():
        if (header.width, header.height) != (first.width, first.height):
            raise SourceError(
                f"{files[i]}: is {header.width}x{header.height}, but {files[chosen[0]].name} is "
                f"{first.width}x{first.height}; all frames must have one size "
                "(a recipe that only packs, with flakes: none and no blur, takes any sizes)"
            )
    return FrameReader(
        width=first.width,
        height=first.height,
        fps=None,
        count=len(files),
        read=lambda i: decode(files[i], headers[i]),
        inputs=tuple(files),
    )


def width_for(height: int, size: tuple[int, int]) -> int:
    """Return the width, px, that keeps the shape of ``size`` (width, height) at ``height``."""
    return max(1, int(size[0] * height / size[1] + 0.5))


def nearest(picture: Picture, width: int, height: int) -> Picture:
    """Return a picture (height, width, 4) of the pixels nearest to each place: no new colours."""
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_NEAREST_EXACT))


def resize(pixels: Pixels, width: int, height: int) -> Pixels:
    """Return pixels (height, width, 4): area averages when shrinking, bicubic when growing.

    Bicubic overshoots beside edges; the result is held to what premultiplied light can be.
    """
    if pixels.shape[:2] == (height, width):
        return pixels
    if height <= pixels.shape[0] and width <= pixels.shape[1]:
        shrunk = cast(Pixels, cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA))
        # The weights of an average may sum to an ulp more than 1.
        np.minimum(shrunk[..., 3], 1, out=shrunk[..., 3])
        return shrunk
    grown = cast(Pixels, cv2.resize(pixels, (width, height), interpolation=cv2.INTER_CUBIC))
    rgb, alpha = grown[..., :3], np.clip(grown[..., 3], 0, 1)
    np.maximum(rgb, 0, out=rgb)
    if bool((brightest(pixels) <= pixels[..., 3]).all()):
        # Not HDR: nothing shines brighter than it covers, and so it must stay.
        np.minimum(rgb, alpha[..., None], out=rgb)
    grown[..., 3] = alpha
    return grown
