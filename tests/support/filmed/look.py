"""Measure the look of flakes as footage of embers was measured: colour, brightness, shape."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fire_atlas.effect.flakes.tracks import by_column
from tests.support.filmed.close_ups import HEIGHT, CloseUps

Values = NDArray[np.float64]

RED_LEVELS = (80, 120, 160, 200, 228, 245)
"""Red of a core, of 255, at which its green and blue are stated."""

_NEAR_RED, _NEAR_BRIGHT_RED = 15.0, 8.0
"""Reds this close to a level count for it; the second for those above 220, where green is steep."""

_FEW = 5
"""Number of flakes below which nothing is said of them."""


def look_figures(rows: Values, seen: CloseUps) -> dict[str, float]:
    """Return the figures of colour, brightness and shape by their names in ``filmed.ROWS``.

    Args:
        rows: (flakes, columns), as in ``Tracks.frames``.
        seen: Measures of the same flakes, all of them bright enough to be seen.
    """
    if len(rows) < _FEW:
        return {}
    column = by_column(rows)
    return {**_colour(seen), **_brightness(seen), **_shape(seen), **_widths(column)}


def _colour(seen: CloseUps) -> dict[str, float]:
    large = seen.where(seen.area >= 9)
    red, green, blue = large.core.T
    figures = _at_levels(red, green, blue)
    warm = red > 40
    if warm.sum() < _FEW:
        return figures
    ratio = green[warm] / red[warm]
    edge = large.rim[large.rim[:, 0] > 15]
    if len(edge) >= _FEW:
        figures["rim to core"] = float(np.median(edge[:, 1] / edge[:, 0]) / np.median(ratio))
    low, high = np.percentile(ratio, [25, 75])
    return figures | {
        "core spread": float(high - low),
        "yellow-white": float(((red >= 245) & (green >= 170)).mean()),
        "without blue": float((blue[red > 60] == 0).mean()) if (red > 60).any() else 0.0,
    }


def _at_levels(red: Values, green: Values, blue: Values) -> dict[str, float]:
    """Return green and blue at each of the ``RED_LEVELS``, by a line through the cores near it."""
    figures = {}
    for level in RED_LEVELS:
        near = np.abs(red - level) <= (_NEAR_RED if level < 220 else _NEAR_BRIGHT_RED)
        if near.sum() < _FEW or np.ptp(red[near]) < 2:
            continue
        for name, value in (("green", green), ("blue", blue)):
            line = np.polynomial.Polynomial.fit(red[near], value[near], 1)
            figures[f"{name} at {level}"] = float(line(level))
    return figures


def _brightness(seen: CloseUps) -> dict[str, float]:
    light = np.log(seen.light)
    share = np.sort(seen.light)[-max(1, len(light) // 20) :].sum() / seen.light.sum()
    return {
        "peak": float(np.median(seen.peak)),
        "dim": float((seen.peak < 80).mean()),
        "bright": float((seen.peak >= 180).mean()),
        "light spread": float(light.std()),
        "light p95": float(np.exp(np.percentile(light, 95) - np.median(light))),
        "light skew": float(((light - light.mean()) ** 3).mean() / max(light.std(), 1e-9) ** 3),
        "top light": float(share),
    }


def _shape(seen: CloseUps) -> dict[str, float]:
    longer = seen.length / seen.width
    figures = {
        "width": 100 * float(np.median(seen.width)) / HEIGHT,
        "width p95": 100 * float(np.percentile(seen.width, 95)) / HEIGHT,
        "width spread": float(np.log(seen.width).std()),
        "length": float(np.median(longer)),
        "length p90": float(np.percentile(longer, 90)),
    }
    if (streak := longer >= 2.2).sum() >= _FEW:
        figures["halves"] = float(np.median(seen.halves[streak]))
    sharp = (seen.width >= 2) & (seen.peak >= 100) & (2.5 * seen.width < 13)
    if sharp.sum() >= _FEW:
        one, more, far = (100 * np.nanmedian(seen.halo[sharp], axis=0)).tolist()
        figures |= {"halo 1": one, "halo 1.5": more, "halo 2.5": far}
    return figures


def _widths(column: Mapping[str, Values]) -> dict[str, float]:
    """Return the share of the most common drawn width, within 2 %, and of flakes out of focus."""
    widths = np.sort(column["size"])
    within = np.searchsorted(widths, widths * 1.04, "right") - np.arange(len(widths))
    return {
        "one width": float(within.max() / len(widths)),
        "out of focus": float((column["blur"] > 0).mean()),
    }
