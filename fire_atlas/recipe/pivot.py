"""A pivot as a recipe states it: a point in or near a frame."""

from typing import Annotated

from pydantic import AfterValidator

from fire_atlas.recipe.base import LIST

_MIN_PIVOT, _MAX_PIVOT = -2.0, 3.0
"""Limits on a pivot, frame widths and heights: up to two frames beside the frame."""


def _near_frame(pivot: tuple[float, float]) -> tuple[float, float]:
    """Return a pivot in or near the frame; refuse others, which are probably px."""
    if not all(_MIN_PIVOT <= coordinate <= _MAX_PIVOT for coordinate in pivot):
        raise ValueError(
            f"is in frame widths and heights, not px, from {_MIN_PIVOT:g} to {_MAX_PIVOT:g}: "
            f"[0.5, 1] is the middle of the bottom; got [{pivot[0]:g}, {pivot[1]:g}]"
        )
    return pivot


PivotPoint = Annotated[tuple[float, float], AfterValidator(_near_frame), LIST]
"""[x, y] in frame widths and heights, from the top-left corner."""
