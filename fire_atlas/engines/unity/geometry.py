"""Unity's axes: pages, rects and pivots are measured from the bottom left, y up."""

from typing import NamedTuple

from fire_atlas.atlas.sheet import Region

_LEAST_MAX_SIZE = 2048


class Rect(NamedTuple):
    """A sprite on its page, px: bottom-left corner, y up, and size."""

    x: int
    y: int
    width: int
    height: int


def rect_of(region: Region, page_height: int) -> Rect:
    """Return where the pixels of a frame are on a page of that height."""
    bottom = page_height - region.y - region.height
    return Rect(region.x, bottom, region.width, region.height)


def pivot_of(region: Region) -> tuple[float, float]:
    """Return the pivot (x, y) in 0..1 of the trimmed frame, y up; outside of it if need be."""
    x, y = pivot_px(region)
    bottom = region.trim_y + region.height
    return (x - region.trim_x) / region.width, (bottom - y) / region.height


def pivot_px(region: Region) -> tuple[float, float]:
    """Return the pivot (x, y) in px of the untrimmed frame, y down."""
    return region.anchor[0] * region.frame_width, region.anchor[1] * region.frame_height


def max_texture_size(width: int, height: int) -> int:
    """Return the import limit that leaves a page as it is: Unity shrinks what exceeds it."""
    return max(_LEAST_MAX_SIZE, 1 << (max(width, height) - 1).bit_length())
