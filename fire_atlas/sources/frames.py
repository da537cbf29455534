"""Source ``frames``: open images, a sprite sheet, an animation or a video as a clip."""

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
from fire_atlas.sources.listing import MAX_PIXELS, frame_range, locate
from fire_atlas.sources.reader import FrameReader, cached
from fire_atlas.sources.sheet import open_sheet
from fire_atlas.vision.sampling import evenly_spread

DEFAULT_FPS = 24.0
"""Frames per second of files that state no rate."""
_SAMPLES = 5
"""Number of frames that are decoded to choose a matte."""


def open_frames(
    settings: FramesSource, path: Path, blend_space: str, max_pixels: int = MAX_PIXELS
) -> Clip:
    """Open the frames at ``path``; only headers and a few sample frames are read now.

    Args:
        settings: The recipe's ``source``.
        path: Absolute path or glob.
        blend_space: Encoding in which the client blends, for the luminance matte.
        max_pixels: Limit on the pixels of a picture.

    Raises:
        SourceError: The input is missing, broken, too large, or does not fit the settings.
    """
    reader, chosen = _open_reader(settings, path, max_pixels)
    reader = cached(reader)
    inputs = reader.inputs if len(reader.inputs) == 1 else tuple(reader.inputs[i] for i in chosen)
    choice = matte.choose(settings.matte, map(reader.read, sample_numbers(chosen)), str(path))
    height = settings.height or reader.height
    width = width_for(height, (reader.width, reader.height))
    check_size(f"{path} at height {height}", width, height, max_pixels)
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
    """Resize in linear light, then apply the matte: so it is exact for the resized pixels."""
    pixels = resize(to_light(picture), *size)
    if kind == "luminance":
        return matte.luminance_of_light(pixels, blend_space)
    return matte.over_black(pixels) if kind == "none" else pixels


def sample_numbers(chosen: range) -> list[int]:
    """Return a few of the frame numbers, evenly spread, with the first and the last."""
    return [chosen[i] for i in evenly_spread(0, len(chosen) - 1, _SAMPLES)]


def _open_reader(settings: FramesSource, path: Path, max_pixels: int) -> tuple[FrameReader, range]:
    """Return a reader of the frames at ``path``, and the numbers of those to use."""
    located = locate(path)
    if not located.single:
        if settings.grid is not None:
            raise SourceError(
                f"{path}: grid cuts one image into cells, but this is {len(located.files)} "
                "images; leave grid out, or give one sheet as path"
            )
        chosen = frame_range(settings, len(located.files), path)
        return _open_images(located.files, chosen, max_pixels), chosen
    reader = _open_file(settings, located.files[0], max_pixels)
    return reader, frame_range(settings, reader.count, path)


def _open_file(settings: FramesSource, path: Path, max_pixels: int) -> FrameReader:
    kind = detect_format(path)
    if settings.grid is not None:
        if kind in ("video", "gif"):
            raise SourceError(f"{path}: grid cuts one still image into cells; leave it out here")
        return open_sheet(path, settings.grid, max_pixels)
    if kind == "video":
        from fire_atlas.sources.video import open_video

        return open_video(path, settings.fps, max_pixels)
    if kind in ANIMATIONS:
        read_header(path, max_pixels)
        return open_animation(path, kind, settings.fps, max_pixels)
    return _open_images((path,), range(1), max_pixels)


def _open_images(files: Sequence[Path], chosen: range, max_pixels: int) -> FrameReader:
    """Return a reader with one frame per file; the chosen ones must have the same size."""
    headers = {i: read_header(files[i], max_pixels) for i in chosen}
    first = headers[chosen[0]]
    for i, header in headers.items():
        if (header.width, header.height) != (first.width, first.height):
            raise SourceError(
                f"{files[i]}: is {header.width}x{header.height}, but {files[chosen[0]].name} is "
                f"{first.width}x{first.height}; all frames must have one size "
                "(to pack images of different sizes, set flakes: none and motion_blur: none)"
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
    """Return the width, px, at ``height`` with the aspect ratio of ``size`` (width, height)."""
    return max(1, int(size[0] * height / size[1] + 0.5))


def nearest(picture: Picture, width: int, height: int) -> Picture:
    """Resize by nearest neighbour to (height, width, 4), which makes no new colours."""
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_NEAREST_EXACT))


def resize(pixels: Pixels, width: int, height: int) -> Pixels:
    """Resize to (height, width, 4): by area averages when shrinking, bicubic when growing.

    Bicubic interpolation overshoots at edges; the result is clipped to valid premultiplied light.
    """
    if pixels.shape[:2] == (height, width):
        return pixels
    if height <= pixels.shape[0] and width <= pixels.shape[1]:
        shrunk = cast(Pixels, cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA))
        # By rounding, the weights of an average may sum to slightly more than 1.
        np.minimum(shrunk[..., 3], 1, out=shrunk[..., 3])
        return shrunk
    grown = cast(Pixels, cv2.resize(pixels, (width, height), interpolation=cv2.INTER_CUBIC))
    rgb, alpha = grown[..., :3], np.clip(grown[..., 3], 0, 1)
    np.maximum(rgb, 0, out=rgb)
    if bool((brightest(pixels) <= pixels[..., 3]).all()):
        # Not HDR: no light exceeded its coverage before, so none may afterwards.
        np.minimum(rgb, alpha[..., None], out=rgb)
    grown[..., 3] = alpha
    return grown
