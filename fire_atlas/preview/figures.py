"""Figures about an atlas as text, for tables and the preview page."""

from collections.abc import Iterable
from dataclasses import dataclass

from fire_atlas.effect.flakes.statistics import Figure
from fire_atlas.formats.atlas.texture_packer import AtlasFile


@dataclass(frozen=True, slots=True)
class PageUse:
    """Use of a page's area.

    Attributes:
        frames: Number of frames on it.
        places: Number of rectangles they take; equal frames may share one.
        occupancy: Fraction of the page's area that they cover, 0..1.
    """

    frames: int
    places: int
    occupancy: float


def page_use(atlas: AtlasFile, page: int) -> PageUse:
    """Return the use of a page."""
    frames = atlas.sheet.regions_of(page)
    places = {(frame.x, frame.y, frame.width, frame.height) for frame in frames}
    covered = sum(width * height for _, _, width, height in places)
    area = atlas.sheet.pages[page].width * atlas.sheet.pages[page].height
    return PageUse(len(frames), len(places), covered / area)


def safe_mip(level: int | None) -> str:
    """Return the smallest mip level at which no frame mixes with its neighbours, as text."""
    return "none, not even filtering" if level is None else str(level)


def value_text(figure: Figure) -> str:
    """Return the value of a figure with its unit."""
    return f"{figure.value:.3g} {figure.unit}".strip()


def range_text(low: float | None, high: float | None) -> str:
    """Return a range in which a figure should lie; None is an open side, empty if both are."""
    if low is None:
        return "" if high is None else f"at most {high:g}"
    return f"at least {low:g}" if high is None else f"{low:g} to {high:g}"


def span(values: Iterable[int]) -> str:
    """Return the range of some values, as text: ``3..5``, or ``3`` if all are equal."""
    known = sorted(values)
    low, high = known[0], known[-1]
    return str(low) if low == high else f"{low}..{high}"
