"""Figures about a result, in words, for tables and the preview page."""

from collections.abc import Iterable
from dataclasses import dataclass

from fire_atlas.atlas.sheet import Page
from fire_atlas.effect.flakes.statistics import Figure
from fire_atlas.formats.atlas.texture_packer import AtlasFile


@dataclass(frozen=True, slots=True)
class PageUse:
    """How a page is filled.

    Attributes:
        frames: Frames that lie on it.
        places: Places they take: equal frames may share one.
        occupancy: Part of its area that frames cover.
    """

    frames: int
    places: int
    occupancy: float


def page_use(atlas: AtlasFile, page: int) -> PageUse:
    """Return how a page is filled."""
    frames = atlas.sheet.regions_of(page)
    places = {(frame.x, frame.y, frame.width, frame.height) for frame in frames}
    covered = sum(width * height for _, _, width, height in places)
    area = atlas.sheet.pages[page].width * atlas.sheet.pages[page].height
    return PageUse(len(frames), len(places), covered / area)


def safe_mip(page: Page) -> str:
    """Say how deep a client may go before neighbouring frames mix."""
    return "none, not even filtering" if page.safe_mip is None else str(page.safe_mip)


def told(figure: Figure) -> str:
    """Return a figure with its unit."""
    return f"{figure.value:.3g} {figure.unit}".strip()


def wanted(figure: Figure) -> str:
    """Say where a figure should lie; empty if it may lie anywhere."""
    match figure.low, figure.high:
        case None, None:
            return ""
        case low, None:
            return f"at least {low:g}"
        case None, high:
            return f"at most {high:g}"
        case low, high:
            return f"{low:g} to {high:g}"


def span(values: Iterable[int]) -> str:
    """Return the least and the greatest of some values, or the one they all are."""
    known = sorted(values)
    low, high = known[0], known[-1]
    return str(low) if low == high else f"{low}..{high}"
