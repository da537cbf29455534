"""Write animated images: WebP and APNG, which are lossless, and GIF."""

import io
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

from fire_atlas.core.pixels import Bytes
from fire_atlas.formats.movies.movie import Movie, schedule
from fire_atlas.formats.pages import png

_MS = 1000
_MAX_DELAY = 65535
"""Largest numerator of a delay in an APNG."""

_GIF_TICK, _GIF_MINIMUM = 10, 20
"""Unit and minimum of durations in a GIF, ms: browsers slow down frames that are shorter."""

_MAX_COLOURS = 255
"""Maximum number of colours in a GIF; the last entry of its table means transparent."""
_TRANSPARENT = 255
_PALETTE_FRAMES = 16
_PALETTE_PIXELS = 1 << 18
"""Maximum numbers of frames and of pixels from which the palette is chosen."""


def webp(movie: Movie) -> bytes:
    """Return an animated WebP, lossless where alpha is above 0."""
    shown = schedule(movie.durations, 1, 1)
    return _by_pillow(
        "WEBP",
        (Image.fromarray(movie.frame(i)) for i, _ in shown),
        duration=[length for _, length in shown],
        loop=0 if movie.loop else 1,
        lossless=True,
    )


def apng(movie: Movie) -> bytes:
    """Return an animated PNG, lossless, of which every frame is a whole picture."""
    shown = schedule(movie.durations, 1, 1)
    file = io.BytesIO()
    file.write(png.SIGNATURE)
    png.write_header(file, movie.width, movie.height)
    png.write_chunk(file, b"acTL", struct.pack(">II", len(shown), 0 if movie.loop else 1))
    number = 0  # of a chunk of the animation
    for i, length in shown:
        place = struct.pack(">IIIII", number, movie.width, movie.height, 0, 0)
        as_it_is = bytes(2)  # not cleared afterwards, not blended with the frame before
        png.write_chunk(file, b"fcTL", place + _delay(length) + as_it_is)
        number += 1
        pixels = png.compressed_pixels(movie.frame(i))
        if number == 1:
            png.write_chunk(file, b"IDAT", pixels)
        else:
            png.write_chunk(file, b"fdAT", struct.pack(">I", number) + pixels)
            number += 1
    png.write_chunk(file, b"IEND", b"")
    return file.getvalue()


def _delay(length: int) -> bytes:
    """Return a duration, ms, as a fraction of seconds; beyond 65 s in coarser steps."""
    step = next(step for step in (1, 10, 100, 1000) if length <= _MAX_DELAY * step)
    return struct.pack(">HH", round(length / step), _MS // step)


def gif(movie: Movie) -> bytes:
    """Return a GIF: all frames share one palette, and an ordered pattern of opaque pixels stands
    for alpha, the same in every frame, so that neither flickers."""
    shown = schedule(movie.durations, _GIF_TICK, _GIF_MINIMUM)
    palette = _Palette.of(movie)
    pictures = (palette.picture(movie.frame(i)) for i, _ in shown)
    transparency = {} if palette.is_opaque else {"transparency": _TRANSPARENT, "disposal": 2}
    return _by_pillow(
        "GIF",
        pictures,
        duration=[length for _, length in shown],
        optimize=False,
        **({"loop": 0} if movie.loop else {}),
        **transparency,
    )


def _by_pillow(name: str, pictures: Iterator[Image.Image], **options: Any) -> bytes:
    file = io.BytesIO()
    next(pictures).save(file, name, save_all=True, append_images=pictures, **options)
    return file.getvalue()


class _Palette(NamedTuple):
    """The colours of a GIF, and whether all of its pixels are opaque."""

    colours: Bytes
    """(colours, 3), sRGB."""
    is_opaque: bool

    @classmethod
    def of(cls, movie: Movie) -> "_Palette":
        """Choose the palette of a movie: its own colours if they are few enough, else those that
        fit a sample of its pixels best."""
        few: NDArray[np.uint32] | None = np.empty(0, np.uint32)
        is_opaque = True
        for i in range(len(movie.durations)):
            frame = movie.frame(i)
            seen = _is_shown(frame[..., 3])
            is_opaque &= bool(seen.all())
            if few is not None:
                few = np.union1d(few, _as_numbers(frame[seen]))
                few = few if len(few) <= _MAX_COLOURS else None
        return cls(_sampled_palette(movie) if few is None else _as_colours(few), is_opaque)

    def picture(self, frame: Bytes) -> Image.Image:
        """Return a frame (H, W, 4) in the nearest colours of the palette."""
        seen = _is_shown(frame[..., 3])
        indices = np.full(seen.shape, _TRANSPARENT, np.uint8)
        numbers, places = np.unique(_as_numbers(frame[seen]), return_inverse=True)
        if numbers.size:
            _, nearest = cKDTree(self.colours.astype(np.float64)).query(_as_colours(numbers))
            indices[seen] = nearest[places]
        picture = Image.fromarray(indices, "P")
        table = np.zeros((256, 3), np.uint8)
        table[: len(self.colours)] = self.colours
        picture.putpalette(table.tobytes())
        return picture


def _sampled_palette(movie: Movie) -> Bytes:
    samples, count = [], len(movie.durations)
    for i in range(0, count, -(-count // _PALETTE_FRAMES)):
        frame = movie.frame(i)
        samples.append(frame[..., :3][_is_shown(frame[..., 3])])
    pixels = np.concatenate(samples)
    pixels = pixels[:: -(-len(pixels) // _PALETTE_PIXELS)]
    chosen = Image.fromarray(pixels[None]).quantize(_MAX_COLOURS, kmeans=1).getpalette()
    return np.unique(np.array(chosen, np.uint8).reshape(-1, 3), axis=0)


def _is_shown(alpha: Bytes) -> NDArray[np.bool_]:
    """Return which pixels of an alpha channel (H, W) are opaque in an ordered pattern of 8 x 8 px
    that has the same mean."""
    height, width = alpha.shape
    tiles = np.tile(_THRESHOLDS, (-(-height // 8), -(-width // 8)))
    return np.asarray(alpha > tiles[:height, :width])


def _bayer(side: int) -> NDArray[np.int64]:
    """Return Bayer's matrix of ordered dithering, (side, side): the numbers from 0 to side² - 1."""
    if side == 1:
        return np.zeros((1, 1), np.int64)
    inner = 4 * _bayer(side // 2)
    return np.block([[inner, inner + 2], [inner + 3, inner + 1]])


_THRESHOLDS = (_bayer(8) + 0.5) / 64 * 255
"""(8, 8), what alpha has to exceed, of 255."""


def _as_numbers(colours: Bytes) -> NDArray[np.uint32]:
    """Return colours (n, 3 or 4) as one number each, (n,)."""
    return np.asarray(colours[..., :3] @ np.array([1 << 16, 1 << 8, 1], np.uint32))


def _as_colours(numbers: NDArray[np.uint32]) -> Bytes:
    """Return the colours (n, 3) of numbers (n,)."""
    return np.stack([numbers >> 16 & 255, numbers >> 8 & 255, numbers & 255], -1).astype(np.uint8)
