"""Sizes of frames by their names, as ``source.size`` of generated fire states them."""

from typing import Literal

FrameSize = Literal["draft", "game", "hero"]

LONGER_SIDE: dict[FrameSize, int] = {"draft": 192, "game": 384, "hero": 512}
"""Length of a frame's longer side, px, from the smallest size to the largest."""


def frame_of(size: FrameSize, aspect: float) -> tuple[int, int]:
    """Return the width and height, px, of a frame that is ``aspect`` times as wide as high."""
    side = LONGER_SIDE[size]
    return (side, round(side / aspect)) if aspect > 1 else (round(side * aspect), side)
