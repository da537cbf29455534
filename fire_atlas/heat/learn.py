"""Learn a ramp from the pixels of a clip: a principal curve through their colours.

After Hastie & Stuetzle, Principal Curves (1989): project the pixels onto the curve, replace each of
its points by the mean of the pixels near it, and repeat. The points are the entries of the ramp, so
they are spread evenly between two rounds. Luminance must not fall along the curve: neighbours where
it would are pooled, as isotonic regression does.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import RAMP_WIDTH
from fire_atlas.core.pixels import REC709, Bytes
from fire_atlas.heat.ramp import MAX_STEP, finished_ramp

_BITS = 5
"""Bits of each channel that tell the bins of pixels apart. A bin keeps the exact mean of its
pixels; with 6 bits no clip is held 0.1 dB better, for three times the time."""

_ROUNDS = 24
"""Rounds of projecting and averaging; more gain less than 0.1 dB."""

_FIRST_WIDTH, _LAST_WIDTH = 16.0, 8.0
"""Standard deviation, entries, of the averaging along the curve in the first and last rounds."""

_NARROWING = 0.8
"""Ratio of that in consecutive rounds."""

_PRIOR = 1e-3
"""Weight of the curve as it was in an average, of the mean number of pixels of an entry."""

_COMPARED = 4096
"""Bins that are compared with all entries at a time, to limit memory."""

_WIDE_STEP = MAX_STEP - 0.5
"""Distance of entries where there are no pixels."""

Curve = NDArray[np.float64]
"""(256, 4): premultiplied R, G, B and A of each entry, 0..255."""


class Colours(NamedTuple):
    """Colours of pixels, in bins.

    Attributes:
        mean: Mean premultiplied R, G, B and A of each bin, (n, 4), 0..255.
        pixels: Number of its pixels, (n,).
    """

    mean: NDArray[np.float64]
    pixels: NDArray[np.float64]


class Bins(NamedTuple):
    """Sums of the colours of pixels, in whole numbers: no result depends on their order.

    Attributes:
        keys: Of each bin, increasing, (n,).
        sums: Sums of its premultiplied R, G, B and A, and its pixels, (n, 5).
    """

    keys: NDArray[np.int64]
    sums: NDArray[np.int64]


def bins_of(image: Bytes) -> Bins:
    """Return the bins of an encoded image's pixels (h, w, 4) that show anything."""
    pixels = image.reshape(-1, 4)
    values = pixels[pixels.any(axis=1)].astype(np.int64)
    keys = (values >> (8 - _BITS)) @ (1 << _BITS * np.arange(4))
    return _grouped(keys, np.column_stack([values, np.ones(len(values), np.int64)]))


def _grouped(keys: NDArray[np.int64], sums: NDArray[np.int64]) -> Bins:
    order = np.argsort(keys, kind="stable")
    keys, sums = keys[order], sums[order]
    first = np.flatnonzero(np.diff(keys, prepend=-1))
    return Bins(keys[first], np.add.reduceat(sums, first, axis=0) if len(first) else sums)


def merged(parts: Iterable[Bins]) -> Colours:
    """Return the colours of the pixels of several images."""
    total = Bins(np.zeros(0, np.int64), np.zeros((0, 5), np.int64))
    for part in parts:
        keys, sums = zip(total, part, strict=True)
        total = _grouped(np.concatenate(keys), np.concatenate(sums))
    count = total.sums[:, 4].astype(np.float64)
    return Colours(total.sums[:, :4] / count[:, None], count)


def learn_ramp(colours: Colours, alpha: str, blend_space: str) -> Bytes:
    """Return the ramp (256, 4), encoded as pages are, that a clip's colours lie on best."""
    if not len(colours.pixels):
        return np.zeros((RAMP_WIDTH, 4), np.uint8)
    curve, width = _first_curve(colours), _FIRST_WIDTH
    for _ in range(_ROUNDS):
        places = _projected(colours, curve)
        curve, pixels = _averaged(colours, places, curve, width)
        curve = _spread(_isotonic(curve, pixels), pixels)
        width = max(width * _NARROWING, _LAST_WIDTH)
    return finished_ramp(curve, alpha, blend_space)


def _first_curve(colours: Colours) -> Curve:
    """Return a straight curve from nothing to the mean of the brightest pixels."""
    brightness = colours.mean.sum(axis=1)
    bright = brightness >= 0.98 * brightness.max()
    end = np.average(colours.mean[bright], axis=0, weights=colours.pixels[bright])
    return np.linspace(0, 1, RAMP_WIDTH)[:, None] * end


def _projected(colours: Colours, curve: Curve) -> NDArray[np.float64]:
    """Return the place on the curve, in entries, that is nearest to each bin, (n,)."""
    places = np.empty(len(colours.pixels))
    for top in range(0, len(places), _COMPARED):
        some = colours.mean[top : top + _COMPARED]
        nearest = ((curve * curve).sum(axis=1) - 2 * some @ curve.T).argmin(axis=1)
        left, right = (_on_segment(some, curve, nearest + side) for side in (-1, 0))
        places[top : top + _COMPARED] = np.where(left[1] <= right[1], left[0], right[0])
    return places


def _on_segment(
    points: NDArray[np.float64], curve: Curve, segments: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the nearest places on segments of the curve, and the squared distances to them."""
    segments = np.clip(segments, 0, RAMP_WIDTH - 2)
    start, step = curve[segments], curve[segments + 1] - curve[segments]
    length = np.maximum((step * step).sum(axis=1), 1e-12)
    along = np.clip(((points - start) * step).sum(axis=1) / length, 0, 1)
    miss = points - start - along[:, None] * step
    return segments + along, (miss * miss).sum(axis=1)


def _averaged(
    colours: Colours, places: NDArray[np.float64], curve: Curve, width: float
) -> tuple[Curve, NDArray[np.float64]]:
    """Return the curve moved to the means of the pixels near it, and the pixels of each entry.

    What is averaged is their distance from the curve, so that it does not shrink at its ends.
    """
    entry = np.minimum(places.astype(np.intp), RAMP_WIDTH - 2)
    after = places - entry
    on_curve = curve[entry] + after[:, None] * (curve[entry + 1] - curve[entry])
    values = np.column_stack([colours.mean - on_curve, np.ones(len(entry))])
    sums = np.zeros((RAMP_WIDTH, 5))
    for at, share in ((entry, 1 - after), (entry + 1, after)):
        for channel, column in enumerate(values.T):
            sums[:, channel] += np.bincount(at, share * colours.pixels * column, RAMP_WIDTH)
    near = _smoothed(sums, width)
    moved = curve + near[:, :4] / (near[:, 4:] + _PRIOR * colours.pixels.sum() / RAMP_WIDTH)
    moved[0] = 0
    return np.clip(moved, 0, 255), sums[:, 4]


def _smoothed(values: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Return columns (n, k) smoothed by a Gaussian of this standard deviation, entries."""
    reach = int(np.ceil(3 * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    columns = (np.convolve(column, kernel)[reach : reach + len(values)] for column in values.T)
    return np.column_stack(list(columns))


def _isotonic(curve: Curve, pixels: NDArray[np.float64]) -> Curve:
    """Return the curve with neighbours pooled until luminance does not fall."""
    pools: list[tuple[NDArray[np.float64], float, int]] = []
    for colour, weight in zip(curve, pixels + 1e-6, strict=True):
        pools.append((colour, float(weight), 1))
        while len(pools) > 1 and _luminance(pools[-2][0]) > _luminance(pools[-1][0]):
            (low, ours, m), (high, theirs, n) = pools[-2:]
            mean = (low * ours + high * theirs) / (ours + theirs)
            pools[-2:] = [(mean, ours + theirs, m + n)]
    return np.concatenate([np.tile(colour, (n, 1)) for colour, _, n in pools])


def _luminance(colour: NDArray[np.float64]) -> float:
    """Return about the linear luminance of a colour (4,), 0..255, over black."""
    return float((colour[:3] / 255) ** 2.2 @ REC709)


def _spread(curve: Curve, pixels: NDArray[np.float64]) -> Curve:
    """Return the curve with its points evenly spaced, but far apart where there are no pixels."""
    steps = np.sqrt((np.diff(curve, axis=0) ** 2).sum(axis=1))
    used = _smoothed(pixels[:, None], 2.0)[:, 0]
    used = np.maximum(used[1:], used[:-1]) > 1e-5 * pixels.sum() / RAMP_WIDTH
    lengths = float(steps[used].sum()), float(steps[~used].sum())
    entries = RAMP_WIDTH - 1 - lengths[1] / _WIDE_STEP
    weight = np.where(used, 1, min(lengths[0] / max(entries, 1) / _WIDE_STEP, 1))
    along = np.concatenate([[0], np.cumsum(steps * weight + 1e-9)])
    at = np.linspace(0, along[-1], RAMP_WIDTH)
    return np.column_stack([np.interp(at, along, column) for column in curve.T])
