"""A sprite with one marked pixel that moves, for engines to be asked where they show it.

Trimmed, off-centre, and with pivots that differ from animation to animation: a wrong sign, a pivot
taken of the trimmed frame or an offset of the wrong animation puts the mark somewhere else.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fire_atlas.atlas.drawing import Edges, draw_page
from fire_atlas.atlas.pages import build_sheets
from fire_atlas.atlas.sheet import AnimationFrames, AtlasSheet, Sprite
from fire_atlas.atlas.trim import trimmed
from fire_atlas.core.workers import Workers
from fire_atlas.formats.pages.page_file import write_page
from fire_atlas.recipe.output import Atlas

MARK = (0, 255, 0)
"""Colour of the marked pixel. All else that is visible is grey, half transparent."""

COUNT = 5
"""Frames of each animation."""

SIZES = {"walk": (48, 64), "tree": (32, 88)}
"""Width and height of the untrimmed frames of each animation, px."""


@dataclass(frozen=True)
class Marked:
    """What the sprite was made into.

    Attributes:
        settings: The recipe's ``atlas``.
        sheet: The atlas, called ``mark``; ``write_pages`` writes its pages.
        sprites: The frames, in the order of ``sheet.regions``.
        marks: Where each animation shows the middle of the marked pixel: (x, y) px from the pivot,
            x right, y down, one for each frame.
    """

    settings: Atlas
    sheet: AtlasSheet
    sprites: tuple[Sprite, ...]
    marks: dict[str, list[tuple[float, float]]]

    def write_pages(self, folder: Path) -> None:
        """Write the pages, as a build does."""
        for i, page in enumerate(self.sheet.pages):
            image = draw_page(self.sheet, i, self.sprites, Edges.of(self.settings, 1.0))
            with Workers(1) as workers, (folder / page.file).open("wb") as file:
                write_page(file, image, self.settings, workers)


def marked(pivot: tuple[float, float] = (0.25, 0.75), **atlas: Any) -> Marked:
    """Make the sprite; ``pivot`` is in widths and heights of a frame, from its top-left corner."""
    settings = Atlas.model_validate({"pivot": list(pivot), **atlas})
    animations, marks = [], dict[str, list[tuple[float, float]]]()
    for name, (width, height) in SIZES.items():
        frames = [_frame(i, width, height) for i in range(COUNT)]
        animations.append(
            AnimationFrames(name, tuple(sprite for sprite, _ in frames), 40.0, True, None)
        )
        origin = pivot[0] * width, pivot[1] * height
        marks[name] = [(x + 0.5 - origin[0], y + 0.5 - origin[1]) for _, (x, y) in frames]
    sheet = build_sheets("mark", animations, settings)[0]
    sprites = tuple(sprite for animation in animations for sprite in animation.sprites)
    return Marked(settings, sheet, sprites, marks)


def _frame(i: int, width: int, height: int) -> tuple[Sprite, tuple[int, int]]:
    """Return frame ``i`` and the pixel that is marked in it."""
    image = np.zeros((height, width, 4), np.uint8)
    left, top = 3 + 4 * i, height // 2 - 5 * i
    image[top : top + 9 + i, left : left + 13 - i] = (40, 40, 40, 128)
    x, y = left + 2 + i, top + 6
    image[y, x] = (*MARK, 255)
    return trimmed(image), (x, y)
