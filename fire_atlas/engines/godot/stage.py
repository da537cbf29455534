"""Where frames lie around their pivots.

A Godot sprite has one offset for all its frames, but frames may differ in size and pivot. So all
are laid onto one stage, pivot upon pivot: a box of whole px that holds every untrimmed frame. The
margins of a frame's texture widen it to the stage, and the sprite's offset puts the stage so that
the pivots are at the node's own place. Where frames are alike, the stage is the untrimmed frame.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Self

from fire_atlas.atlas.sheet import Region

_DECIMALS = 6


class Margin(NamedTuple):
    """Godot's margin of a texture, px: what is left of and above it, and what is around in all."""

    left: float
    top: float
    across: float
    down: float


@dataclass(frozen=True, slots=True)
class Stage:
    """The box that holds all frames.

    Attributes:
        x, y: Its top-left corner seen from the pivots, px, y down: the sprite's offset.
        width, height: Its size, px.
    """

    x: float
    y: float
    width: int
    height: int

    @classmethod
    def of(cls, regions: Iterable[Region]) -> Self:
        """Return the smallest stage for ``regions``."""
        frames = [(*pivot(region), region.frame_width, region.frame_height) for region in regions]
        left, top = max(x for x, *_ in frames), max(y for _, y, *_ in frames)
        right = max(width - x for x, _, width, _ in frames)
        bottom = max(height - y for _, y, _, height in frames)
        return cls(-left, -top, _whole(left + right), _whole(top + bottom))

    def margin(self, region: Region) -> Margin:
        """Return the margin that widens a frame's texture to the stage."""
        x, y = pivot(region)
        return Margin(
            region.trim_x - x - self.x,
            region.trim_y - y - self.y,
            self.width - region.width,
            self.height - region.height,
        )


def pivot(region: Region) -> tuple[float, float]:
    """Return a frame's pivot, px from the top-left corner of the untrimmed frame, y down."""
    x, y = region.anchor
    return (
        round(x * region.frame_width, _DECIMALS),
        round(y * region.frame_height, _DECIMALS),
    )


def _whole(length: float) -> int:
    return math.ceil(round(length, _DECIMALS))
