"""What a sprite of the user's has of its own, and the frames of a clip have in common."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from fire_atlas.core.errors import OutputError


class Border(NamedTuple):
    """The border of a nine-patch, px: it keeps its size where the middle is stretched."""

    left: int
    top: int
    right: int
    bottom: int

    def scaled(self, scale: float) -> "Border":
        """Return it in another scale, in whole px: no part of it is stretched."""
        return Border(*(math.ceil(length * scale) for length in self))


@dataclass(frozen=True, slots=True)
class NamedSprite:
    """A sprite under its own name.

    Attributes:
        name: Its name in every file: ``hud/close``.
        pivot: (x, y) in widths and heights of the sprite, y down; None: as the atlas states.
        border: Its border as a nine-patch; None if it is none.
    """

    name: str
    pivot: tuple[float, float] | None = None
    border: Border | None = None


def refuse_equal_names(names: Iterable[str]) -> None:
    """Refuse frames of several recipes that have one name.

    Raises:
        OutputError: With the name.
    """
    for name, count in Counter(names).items():
        if count > 1:
            raise OutputError(
                f"{count} frames on these pages are called {name}; rename the file of one, or pack "
                f"its recipe on pages of its own"
            )
