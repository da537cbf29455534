"""Turn encoded frames into heat and back, and measure how well one axis holds their colours."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Self, cast

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.picture import brightest
from fire_atlas.core.pixels import Bytes, is_visible, psnr_of

_COMPARED = 8192
"""Colours that are compared with all entries at a time, to limit memory."""

_OFF_RAMP = 64.0
"""Distance of a pixel's premultiplied colour from that of its heat, of 255 in each channel, beyond
which it is another colour."""

_CLOSE_FROM = 45.0
"""Peak signal-to-noise ratio, dB, from which colours differ by little more than rounding."""

SEEN_BELOW = 32.0
"""Peak signal-to-noise ratio, dB, under which the error is easily seen."""


def heat_of(image: Bytes, ramp: Bytes) -> Bytes:
    """Return the heat (h, w) of encoded pixels (h, w, 4): the entry of ``ramp`` (256, 4) whose
    premultiplied colour and coverage are nearest; 0 where nothing is shown."""
    packed = np.ascontiguousarray(image).view(np.uint32)[..., 0]
    unique, inverse = np.unique(packed, return_inverse=True)
    colours = unique.view(np.uint8).reshape(-1, 4)
    heat = _nearest(colours.astype(np.float32), ramp.astype(np.float32))
    heat[~colours.any(axis=1)] = 0
    return cast(Bytes, heat[inverse].reshape(packed.shape))


def _nearest(colours: NDArray[np.float32], ramp: NDArray[np.float32]) -> Bytes:
    """Return the nearest entry to each colour. Squares of whole numbers up to 255 are exact in
    float32, so that no result depends on the order in which they are summed."""
    heat = np.empty(len(colours), np.uint8)
    size = (ramp * ramp).sum(axis=1)
    for top in range(0, len(colours), _COMPARED):
        some = colours[top : top + _COMPARED]
        heat[top : top + _COMPARED] = (size - 2 * some @ ramp.T).argmin(axis=1)
    return heat


class ErrorSums(NamedTuple):
    """Sums over the visible pixels of a frame: squared differences and their number; light, and
    that of pixels that get another colour."""

    squares: float
    values: int
    light: float
    light_off: float


@dataclass(frozen=True, slots=True)
class HeatError:
    """How far the colours that a ramp gives back are from those of colour pages.

    Attributes:
        rms: Root of the mean squared difference of premultiplied R, G, B and A over all visible
            pixels, of 255.
        off_ramp: Share of the light, 0..1, in pixels that get another colour.
        has_flakes: Whether flakes are drawn into the pixels. They are light added to fire, which
            lies beside the line of the fire's own colours.
    """

    rms: float
    off_ramp: float
    has_flakes: bool

    @property
    def psnr(self) -> float:
        """Peak signal-to-noise ratio, dB; infinite if nothing differs."""
        return psnr_of(self.rms)

    def sentence(self) -> str:
        """Return the figures in words."""
        if not self.rms:
            return "one axis of heat holds the colours exactly"
        share = f"{100 * self.off_ramp:.1f}"
        off = f"; {share} % of the light is off the ramp" if share != "0.0" else ""
        flakes = (
            "; flakes in the pixels may cost part of it: flakes.bake: false leaves them to "
            "clients that draw tracks"
            if self.has_flakes and self.psnr < _CLOSE_FROM
            else ""
        )
        return f"one axis of heat holds the colours at {self.psnr:.1f} dB{off}{flakes}"

    @classmethod
    def of(cls, parts: Iterable[ErrorSums], *, has_flakes: bool) -> Self:
        """Return the error of all frames."""
        known = list(parts)
        values = sum(part.values for part in known)
        light = sum(part.light for part in known)
        rms = math.sqrt(sum(part.squares for part in known) / values) if values else 0.0
        off = sum(part.light_off for part in known) / light if light else 0.0
        return cls(round(rms, 3), round(off, 4), has_flakes)


def error_sums(image: Bytes, heat: Bytes, ramp: Bytes) -> ErrorSums:
    """Sum how far encoded pixels (h, w, 4) are from the colours that the ramp gives for their
    heat (h, w)."""
    exact, ours = image.astype(np.float32), ramp[heat].astype(np.float32)
    light = brightest(exact)
    shown = is_visible(exact[..., 3], light)
    miss, light = (exact - ours)[shown], light[shown].astype(np.float64)
    squares = (miss.astype(np.float64) ** 2).sum(axis=1)
    off = light[squares > _OFF_RAMP**2]
    return ErrorSums(float(squares.sum()), 4 * len(miss), float(light.sum()), float(off.sum()))
