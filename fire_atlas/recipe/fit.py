"""Recipe block ``fit``: a budget for the pages, within which the tool chooses what they hold."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from fire_atlas.recipe.base import (
    BLOCK,
    DIFFERENT,
    LIST,
    NUMBER,
    OFF,
    PAIR,
    WORD,
    Off,
    Settings,
    either,
)

_MAX_SIDE = 16384

_Count = Annotated[int, Field(ge=1, le=4096)]

Cells = Annotated[
    Annotated[_Count, NUMBER]
    | Annotated[tuple[_Count, ...], LIST, Field(min_length=1, max_length=16), DIFFERENT, PAIR],
    either("a whole number from 1 to 4096 or a list of them"),
]


class Fit(Settings):
    """A budget. The effect is made as the recipe says; then the tool chooses the height of its
    frames on the pages, and which frames are left out, so that what is played within the budget
    comes closest to the whole. A frame is shown until the next one that is kept, so that JSON, CSS
    and Godot play frames of unlike durations."""

    page: int | None = Field(default=None, ge=16, le=_MAX_SIDE)
    """Largest width and height of a page, px: the default of ``atlas.max_size``."""
    pages: int | None = Field(default=None, ge=1, le=1024)
    """Largest number of pages: the default of ``atlas.max_pages``, else 1."""
    memory: float | None = Field(default=None, ge=0.001, le=4096)
    """Memory that all pages may take on a GPU, MiB, with the mip levels that are written:
    uncompressed, or with ``atlas.gpu`` compressed. Of the formats that this lists for one family of
    devices (BC, ASTC, ETC2), the one is written that comes closest to the whole."""
    cells: Cells | None = None
    """Largest number of frames of all animations. A list: exactly one of these numbers, in a grid
    with as many columns as rows, so that they have to be square numbers there."""
    shown: int | None = Field(default=None, ge=8, le=_MAX_SIDE)
    """How high a frame is drawn at most, px of the screen: frames need not be higher."""

    @model_validator(mode="after")
    def _has_any(self) -> Self:
        if not any(value is not None for _, value in self):
            raise ValueError(
                "has no budget; give it page, pages, memory, cells or shown, or remove fit"
            )
        return self


ReadyBudget = Literal["roblox", "unity-mobile", "web", "vrchat"]

READY_BUDGETS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "roblox": (
        {"page": 1024, "pages": 1, "cells": [4, 16, 64]},
        {"layout": "grid", "pot": True, "square": True},
    ),
    "unity-mobile": ({"page": 2048, "pages": 1, "memory": 4}, {"multiple_of": 4}),
    "web": ({"page": 4096, "pages": 1, "memory": 16}, {}),
    "vrchat": ({"page": 2048, "pages": 1, "memory": 8}, {"multiple_of": 4}),
}
"""What each word stands for: the budget, and defaults of ``atlas``.

Roblox plays flipbooks of 2 x 2, 4 x 4 and 8 x 8 frames, on a texture of at most 1024 px. The others
are what an effect may take beside a scene: of a phone, of a page, of a world that others made.
"""


FitOrNone = Annotated[
    Off | Annotated[ReadyBudget, WORD] | Annotated[Fit, BLOCK],
    either("`none`, `roblox`, `unity-mobile`, `web`, `vrchat` or a block of settings"),
    OFF,
]
