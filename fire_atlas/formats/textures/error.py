"""How far a compressed texture is from its image: measured when it is written, kept in the
manifest, read from it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.encode import light_over_black
from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Bytes, hue_difference, is_visible, psnr_of
from fire_atlas.core.workers import Workers

_BAND_ROWS = 128
"""Rows that are compared at a time, which bounds the memory."""

_HUE_STEP, _HUE_BINS = 0.1, 4096
"""Width, ΔE, and number of the steps in which differences of hues are counted."""

_HUE_PERCENTILE = 0.995
"""Fraction of the visible pixels whose hues differ by at most the figure."""

_EXACT = 99.0
"""Peak signal-to-noise ratio, dB, that stands for no difference."""


@dataclass(frozen=True, slots=True)
class TextureError:
    """How far a texture's first level, as a GPU decodes it, is from its image.

    Attributes:
        psnr: Peak signal-to-noise ratio, dB, of all channels that are read, colours premultiplied,
            over visible pixels; of vectors, over all; of heat, over values above 0. At most 99.
        hue: Of colours: 99.5th percentile of the distances of their hues, ΔE in CIELAB's plane of
            hues, as they are seen over black. None for data.
    """

    psnr: float
    hue: float | None


class _BandSums(NamedTuple):
    squares: int
    """Sum of squared differences, in (1/255)² of a step of premultiplied colours, so that it is
    exact."""
    values: int
    hues: NDArray[np.int64]
    """Number of pixels of each step of hues."""


def data_error(
    decoded: Bytes, image: Bytes, channels: int, workers: Workers, *, is_heat: bool = False
) -> TextureError:
    """Compare the first ``channels`` of a texture with those of its image, (H, W, 4) uint8.

    Of heat, only values above 0 of the image are compared: a page has much that is empty.
    """

    def compare(rows: slice) -> _BandSums:
        ours, exact = decoded[rows][..., :channels], image[rows][..., :channels]
        difference = ours.astype(np.int64) - exact
        if is_heat:
            difference = difference[exact > 0]
        return _BandSums(
            255**2 * int((difference**2).sum()), difference.size, np.zeros(1, np.int64)
        )

    return TextureError(_psnr(_bands(compare, image, workers)), None)


def colour_texture_error(
    decoded: Bytes, image: Bytes, alpha: str, blend_space: str, workers: Workers
) -> TextureError:
    """Compare the colours of a texture with those of its image.

    Args:
        decoded: As a GPU decodes it, (H, W, 4) uint8.
        image: What was encoded.
        alpha: How alpha is stored: ``straight``, ``premultiplied`` or ``additive``, without alpha.
        blend_space: Encoding in which a client blends.
        workers: Compare bands of rows.
    """

    def compare(rows: slice) -> _BandSums:
        return _compared(decoded[rows], image[rows], alpha, blend_space)

    bands = _bands(compare, image, workers)
    return TextureError(_psnr(bands), _percentile(np.sum([band.hues for band in bands], axis=0)))


def _bands(
    compare: Callable[[slice], _BandSums], image: Bytes, workers: Workers
) -> list[_BandSums]:
    bands = [slice(top, top + _BAND_ROWS) for top in range(0, len(image), _BAND_ROWS)]
    return list(workers.map(compare, bands))


def _compared(ours: Bytes, exact: Bytes, alpha: str, blend_space: str) -> _BandSums:
    """Compare what is visible of a band of rows, as an image of one row."""
    cover = exact[..., 3]
    # No straight colour shows more than its alpha.
    light = cover if alpha == "straight" else brightest(exact)
    visible = is_visible(cover, light)
    ours, exact = ours[visible][None], exact[visible][None]
    if not exact.size:
        return _BandSums(0, 0, np.zeros(_HUE_BINS, np.int64))
    one, other = (_premultiplied(image, alpha == "straight") for image in (ours, exact))
    difference = (one - other)[..., : 3 if alpha == "additive" else 4]
    shown = [light_over_black(image, alpha, blend_space)[0] for image in (ours, exact)]
    steps = (hue_difference(*shown) / np.float32(_HUE_STEP)).astype(np.intp)
    hues = np.bincount(np.minimum(steps, _HUE_BINS - 1), minlength=_HUE_BINS)
    return _BandSums(int((difference**2).sum()), difference.size, hues)


def _premultiplied(image: Bytes, straight: bool) -> NDArray[np.int64]:
    """Return an image (H, W, 4) with premultiplied colours, in 1/255 of a step."""
    values = image.astype(np.int64) * 255
    if straight:
        values[..., :3] = image[..., :3].astype(np.int64) * image[..., 3:]
    return values


def _psnr(bands: list[_BandSums]) -> float:
    squares, values = sum(band.squares for band in bands), sum(band.values for band in bands)
    if not squares:
        return _EXACT
    return min(round(psnr_of(math.sqrt(squares / values) / 255), 2), _EXACT)


def _percentile(counts: NDArray[np.int64]) -> float:
    """Return the upper end of the step in which the percentile of all pixels lies."""
    total = int(counts.sum())
    if not total:
        return 0.0
    step = int(np.searchsorted(np.cumsum(counts), math.ceil(_HUE_PERCENTILE * total)))
    return round((step + 1) * _HUE_STEP, 1)
