"""Read GIF, APNG and animated WebP.

Their frames are patches: rectangles that are drawn one after the other on a canvas. The module of
each format finds the patches, and wraps each as a still image, which the decoder for stills reads.
Timing, disposal and blending are the same for all three, and done here.

Pillow could play them too. But it loses the 16 bits of an APNG and decodes a whole WebP to learn
its delays. In a GIF it fills with a colour the areas that browsers clear, lets frames exceed the
canvas, and does not notice that a file is truncated.
"""

from collections.abc import Generator
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from fire_atlas.core.errors import SourceError
from fire_atlas.core.files import open_file
from fire_atlas.core.picture import Picture, white, with_alpha
from fire_atlas.core.workload import MAX_FRAMES, MAX_PIXELS
from fire_atlas.sources import apng, gif, webp
from fire_atlas.sources.broken import BrokenFileError
from fire_atlas.sources.header import Header
from fire_atlas.sources.images import check_size, decode_bytes, read_bytes, read_header
from fire_atlas.sources.orientation import turned
from fire_atlas.sources.patches import Disposal, EncodedAnimation, Patch
from fire_atlas.sources.reader import FrameReader, SequentialDecoder
from fire_atlas.sources.timing import Timing, time_drawings

_SHORTEST, _DEFAULT_DELAY = Fraction(1, 100), Fraction(1, 10)
"""Browsers show a frame whose file states this delay, s, or less, for the second one."""


def open_animation(
    path: Path, kind: str, fps: float | None, max_pixels: int = MAX_PIXELS
) -> FrameReader:
    """Open a GIF, APNG or WebP as frames at a constant rate; a still image is one frame.

    Raises:
        SourceError: The file is cut short, damaged, too large or has too many frames.
    """
    header = read_header(path, max_pixels)
    animation = _parse(path, kind)
    patches = animation.patches
    for patch in patches:
        check_size(path, patch.width, patch.height, max_pixels)
    patch_delays = (patch.delay for patch in patches)
    delays = [_DEFAULT_DELAY if delay <= _SHORTEST else delay for delay in patch_delays]
    is_still = len(patches) == 1
    timing = Timing(0, (0,)) if is_still else time_drawings(delays, fps, path)
    frames = SequentialDecoder(path, partial(_play, path, animation, header))
    return FrameReader(
        width=header.width,
        height=header.height,
        fps=fps if is_still else timing.rate,
        count=len(timing.shown),
        read=lambda i: frames.read(timing.shown[i]),
        inputs=(path,),
        notes=(*header.notes, *timing.notes),
    )


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
            f"{path}: {len(animation.patches)} frames; at most {MAX_FRAMES} are allowed"
        )
    return animation


def _play(path: Path, animation: EncodedAnimation, header: Header) -> Generator[Picture]:
    """Yield the canvas after each patch, upright. Patches are drawn in sRGB."""
    canvas: Picture | None = None
    with open_file(path) as file:
        for number, patch in enumerate(animation.patches):
            file.seek(patch.start)
            picture = _decode(path, number, animation, patch, file.read(patch.stop - patch.start))
            if header.conversion is not None:
                picture = header.conversion.apply(picture)
            if canvas is None:
                canvas = np.zeros((animation.height, animation.width, 4), picture.dtype)
            area = _area(canvas, patch)
            before = area.copy() if patch.disposal is Disposal.RESTORE else None
            _draw(area, picture[: area.shape[0], : area.shape[1]], blend=patch.blend)
            yield turned(canvas.copy(), header.orientation)
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
    """Return a view of the part of the canvas that a patch covers."""
    return canvas[patch.y : patch.y + patch.height, patch.x : patch.x + patch.width]


def _draw(area: Picture, picture: Picture, *, blend: bool) -> None:
    """Draw ``picture`` over ``area`` (``blend``, straight alpha as stored), or replace it."""
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
    """Composite straight-alpha colours (N, 4), 0..top: ``front`` over ``back``."""
    covered, visible = front[:, 3:] / top, back[:, 3:] / top * (1 - front[:, 3:] / top)
    alpha = covered + visible
    colour = (front[:, :3] * covered + back[:, :3] * visible) / alpha
    return np.rint(np.hstack([colour, alpha * top])).astype(np.uint16 if top > 255 else np.uint8)
