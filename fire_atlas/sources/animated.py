"""Read GIF, APNG and animated WebP: patches drawn one after the other on a canvas.

Each format's module finds the patches without decoding them and can wrap each as a still image of
its format; timing, disposal and blending are then the same code for all three. Pillow, which could
play them too, loses the 16 bits of an APNG; in a GIF it fills with a colour what browsers clear,
lets frames grow past the canvas, and takes a truncated file for a shorter one; and it learns the
delays of a WebP by decoding every frame.
"""

from collections.abc import Generator
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import open_file
from fire_atlas.core.picture import Picture, white, with_alpha
from fire_atlas.sources import apng, gif, webp
from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.images import check_size, decode_bytes, read_bytes
from fire_atlas.sources.listing import MAX_FRAMES, MAX_PIXELS
from fire_atlas.sources.patches import Disposal, EncodedAnimation, Patch
from fire_atlas.sources.reader import FrameReader, resample, sequential_reader

_DEFAULT_DELAY = Fraction(1, 10)
"""A delay of 0 is shown for 100 ms, as browsers do."""


def open_animation(
    path: Path, kind: str, fps: float | None, most_pixels: int = MAX_PIXELS
) -> FrameReader:
    """Return the frames of a GIF, APNG or WebP at a constant rate; a still is one frame.

    Raises:
        SourceError: The file is cut short, damaged, too large or has too many frames.
    """
    animation = _parse(path, kind)
    check_size(path, animation.width, animation.height, most_pixels)
    patches = animation.patches
    for patch in patches:
        check_size(path, patch.width, patch.height, most_pixels)
    if len(patches) == 1:
        rate, shown = fps, [0]
    else:
        rate, shown = resample([p.delay or _DEFAULT_DELAY for p in patches], fps, path)
    size = animation.width, animation.height
    return sequential_reader(path, size, partial(_play, path, animation), rate, shown)


def _parse(path: Path, kind: str) -> EncodedAnimation:
    parse = {"gif": gif.parse, "png": apng.parse, "webp": webp.parse}[kind]
    data = read_bytes(path)
    try:
        animation = parse(data)
    except BrokenFileError as error:
        raise SourceError(f"{path}: {error}; export it again") from error
    except Exception as error:
        raise SourceError(f"{path}: broken {kind.upper()} file ({error})") from error
    if not animation.patches:
        raise SourceError(f"{path}: this {kind.upper()} holds no frames; export it again")
    if len(animation.patches) > MAX_FRAMES:
        raise SourceError(
            f"{path}: {len(animation.patches)} frames; at most {MAX_FRAMES} are taken"
        )
    return animation


def _play(path: Path, animation: EncodedAnimation) -> Generator[Picture]:
    """Yield the canvas after each patch."""
    canvas: Picture | None = None
    with open_file(path) as file:
        for number, patch in enumerate(animation.patches):
            file.seek(patch.start)
            picture = _decode(path, number, animation, patch, file.read(patch.stop - patch.start))
            if canvas is None:
                canvas = np.zeros((animation.height, animation.width, 4), picture.dtype)
            area = _area(canvas, patch)
            before = area.copy() if patch.disposal is Disposal.RESTORE else None
            _draw(area, picture[: area.shape[0], : area.shape[1]], blend=patch.blend)
            yield canvas.copy()
            if before is not None:
                area[...] = before
            elif patch.disposal is Disposal.CLEAR:
                area[...] = 0


def _decode(
    path: Path, number: int, animation: EncodedAnimation, patch: Patch, raw: bytes
) -> Picture:
    try:
        picture = with_alpha(decode_bytes(animation.wrap(patch, raw), animation.format))
    except Exception as error:
        raise SourceError(f"{path}: frame {number} is broken ({error})") from error
    if picture.shape[:2] != (patch.height, patch.width):
        raise SourceError(f"{path}: frame {number} has another size than the file states")
    return picture


def _area(canvas: Picture, patch: Patch) -> Picture:
    """Return the part of the canvas that a patch covers, as a view."""
    return canvas[patch.y : patch.y + patch.height, patch.x : patch.x + patch.width]


def _draw(area: Picture, picture: Picture, *, blend: bool) -> None:
    """Put ``picture`` into ``area``, replacing it or over it (straight alpha, as stored)."""
    if not blend:
        area[...] = picture
        return
    top = white(picture.dtype)
    alpha = picture[..., 3]
    opaque = alpha == top
    np.copyto(area, picture, where=opaque[..., None])
    soft = (alpha > 0) & ~opaque
    if soft.any():
        area[soft] = _over(picture[soft].astype(np.float64), area[soft].astype(np.float64), top)


def _over(front: Picture, back: Picture, top: int) -> Picture:
    """Return the straight-alpha colours (N, 4), 0..top, of ``front`` over ``back``."""
    covered, shows = front[:, 3:] / top, back[:, 3:] / top * (1 - front[:, 3:] / top)
    alpha = covered + shows
    colour = (front[:, :3] * covered + back[:, :3] * shows) / alpha
    return np.rint(np.hstack([colour, alpha * top])).astype(np.uint16 if top > 255 else np.uint8)
