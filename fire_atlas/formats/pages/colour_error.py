"""The colour error of lossy pages: measured when they are written, kept in the manifest, read from
it."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Bytes, is_visible, psnr_of
from fire_atlas.core.workers import Workers

_BAND_ROWS = 128
"""Rows that are compared at a time, which bounds the memory."""


@dataclass(frozen=True, slots=True)
class ColourError:
    """How far the premultiplied colours of a lossy page are from the lossless ones.

    Attributes:
        rms: Root of the mean squared difference over all visible pixels and channels, of 255.
        largest: The largest difference of any channel on the whole page, of 255.
    """

    rms: float
    largest: float

    @property
    def psnr(self) -> float:
        """Peak signal-to-noise ratio, dB; infinite if nothing differs."""
        return psnr_of(self.rms)

    def sentence(self) -> str:
        """Return the figures in words."""
        if not self.largest:
            return "premultiplied colours are those of a lossless page"
        return (
            f"premultiplied colours differ by {self.rms:.2g} of 255 (RMS; {self.psnr:.1f} dB) from "
            f"those of a lossless page, at most by {self.largest:.0f}; alpha is exact"
        )


class _BandError(NamedTuple):
    squares: int
    """Sum of squared differences, in (1/255)² of a step, so that it is exact."""
    pixels: int
    largest: int


def measured_error(lossy: Bytes, lossless: Bytes, straight: bool, workers: Workers) -> ColourError:
    """Compare two pages, both (H, W, 4) uint8 RGBA.

    Args:
        lossy: As a client decodes it.
        lossless: What was encoded.
        straight: Whether their colours are to be multiplied by alpha; otherwise they are light
            already.
        workers: Compare bands of rows.
    """

    def compare(top: int) -> _BandError:
        rows = slice(top, top + _BAND_ROWS)
        return _band_error(lossy[rows], lossless[rows], straight)

    bands = list(workers.map(compare, range(0, len(lossless), _BAND_ROWS)))
    values = 3 * sum(band.pixels for band in bands)
    rms = math.sqrt(sum(band.squares for band in bands) / values) / 255 if values else 0.0
    return ColourError(round(rms, 3), round(max(band.largest for band in bands) / 255, 1))


def _band_error(lossy: Bytes, lossless: Bytes, straight: bool) -> _BandError:
    ours, exact = _light(lossy, straight), _light(lossless, straight)
    difference = ours - exact
    shown = difference[is_visible(lossless[..., 3], brightest(np.maximum(ours, exact)) / 255)]
    return _BandError(int((shown * shown).sum()), len(shown), int(np.abs(difference).max()))


def _light(image: Bytes, straight: bool) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return the premultiplied colours of an image, (H, W, 3), in 1/255 of a step."""
    alpha = image[..., 3:].astype(np.int64) if straight else 255
    return image[..., :3].astype(np.int64) * alpha
