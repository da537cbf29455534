"""Read the border of a nine-patch from its outermost px, as Android draws it.

A picture called ``.9.png`` has a frame of 1 px. Black px of its top and left side mark what is
stretched; those of its right and bottom side mark where content goes, which no export states.
https://developer.android.com/develop/ui/views/graphics/drawables#nine-patch
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fire_atlas.core.errors import SourceError
from fire_atlas.core.named_sprite import Border
from fire_atlas.core.picture import Picture, as_bytes, with_alpha


def split_nine_patch(picture: Picture, path: Path) -> tuple[Picture, Border]:
    """Return the picture (H - 2, W - 2, 4) within the frame, and the border that this marks.

    Raises:
        SourceError: The frame has other px than black and clear ones, or does not mark one part of
            each side.
    """
    if min(picture.shape[:2]) < 3:
        raise SourceError(f"{path}: is no nine-patch: it has no room for a frame of 1 px")
    whole = with_alpha(picture)
    frame = as_bytes(whole)
    left, right = _stretched(frame[0, 1:-1], "top", path)
    top, bottom = _stretched(frame[1:-1, 0], "left", path)
    for side, name in ((frame[-1], "bottom"), (frame[:, -1], "right")):
        _black(side, name, path)
    return whole[1:-1, 1:-1], Border(left, top, right, bottom)


def _stretched(side: NDArray[np.uint8], name: str, path: Path) -> tuple[int, int]:
    """Return how many px of a side (n, 4) are before and behind those that are black."""
    marked = np.flatnonzero(_black(side, name, path)).tolist()
    if not marked or marked != list(range(marked[0], marked[-1] + 1)):
        parts = "several black lines" if marked else "no black line"
        raise SourceError(
            f"{path}: is no nine-patch that engines have: its {name} side has {parts}; draw one "
            f"along what is stretched, or rename the file and state source.borders"
        )
    return marked[0], len(side) - 1 - marked[-1]


def _black(side: NDArray[np.uint8], name: str, path: Path) -> Sequence[bool]:
    """Return which px of a side (n, 4) are black; the others must be clear, or white."""
    black = (side == (0, 0, 0, 255)).all(axis=1)
    clear = (side[:, 3] == 0) | (side == 255).all(axis=1)
    if not (black | clear).all():
        raise SourceError(
            f"{path}: is no nine-patch: its {name} side has px that are neither black nor clear; "
            f"draw its frame, or rename the file without .9"
        )
    return black.tolist()  # type: ignore[no-any-return]
