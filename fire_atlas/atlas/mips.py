"""How deep into the mip levels of a page a client may go before neighbouring frames mix."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fire_atlas.atlas.sheet import AtlasSheet

_TOGETHER = 256
"""Frames compared with all others at a time."""


class _Spans(NamedTuple):
    """From where to where each frame reaches along one axis: (n,), px."""

    start: NDArray[np.int64]
    end: NDArray[np.int64]


def safe_mips(sheet: AtlasSheet, extrude: int) -> list[int | None]:
    """Return for each page the deepest mip level at which each frame has only its own colours.

    Frames have ``extrude`` px of their own around them. Mip levels are averages of blocks, sampled
    with bilinear filtering. None: not even the page itself may be filtered.
    """
    return [_deepest(sheet, page, extrude) for page in range(len(sheet.pages))]


def _deepest(sheet: AtlasSheet, page: int, extrude: int) -> int | None:
    places = sorted({(r.x, r.y, *r.page_size) for r in sheet.regions if r.page == page})
    x, y, width, height = np.array(places, np.int64).T
    across, down = _Spans(x, x + width), _Spans(y, y + height)
    last = max(sheet.pages[page].width, sheet.pages[page].height).bit_length() - 1
    for level in range(last + 1):
        if _mixes(across, down, extrude, 1 << level):
            return level - 1 if level else None
    return last


def _mixes(across: _Spans, down: _Spans, extrude: int, block: int) -> bool:
    """Whether any frame is mixed with another where a texel is ``block`` px wide."""
    reach = [_reach(spans, block) for spans in (across, down)]
    owned = [_Spans(s.start - extrude, s.end + extrude) for s in (across, down)]
    count = len(across.start)
    for first in range(0, count, _TOGETHER):
        some = slice(first, first + _TOGETHER)
        meets = np.ones((len(across.start[some]), count), np.bool_)
        for reached, own in zip(reach, owned, strict=True):
            meets &= reached.start[some, None] < own.end
            meets &= reached.end[some, None] > own.start
        if np.count_nonzero(meets) > len(meets):  # each frame meets itself
            return True
    return False


def _reach(spans: _Spans, block: int) -> _Spans:
    """Return which px take part in the texels that filtering from edge to edge reads."""
    half = block / 2
    start = np.floor((spans.start - half) / block).astype(np.int64) * block
    end = (np.floor((spans.end - half) / block).astype(np.int64) + 2) * block
    return _Spans(start, end)
