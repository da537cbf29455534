"""The page sizes that a recipe allows."""

import math
from dataclasses import dataclass
from typing import Self

from fire_atlas.atlas.trim import up_to
from fire_atlas.recipe.output import Atlas

Size = tuple[int, int]
"""Width and height."""


_LONG, _LONG_COST = 3.0, 0.02
"""Pages with an aspect above the first count as larger, by the second for each 1 of aspect more:
their long side is the first to exceed a device's maximum texture size."""


def effective_area(size: Size) -> float:
    """Return the area of a page, increased if the page is very long."""
    aspect = max(size) / min(size)
    return size[0] * size[1] * (1 + _LONG_COST * max(aspect - _LONG, 0.0))


@dataclass(frozen=True, slots=True)
class PageRules:
    """Limits on pages as a recipe states them. All lengths in px, or all in the same larger unit.

    Attributes:
        max_size: Maximum side.
        padding: Empty space between neighbours.
        border: Empty space along every edge.
        multiple_of: Number that sides must be multiples of.
        pot: Whether sides must be powers of two.
        square: Whether both sides must be equal.
        rotate: Whether rectangles may be turned by 90°.
    """

    max_size: int
    padding: int = 0
    border: int = 0
    multiple_of: int = 1
    pot: bool = False
    square: bool = False
    rotate: bool = False

    @property
    def largest(self) -> int:
        """The largest side allowed; 0 if no side is."""
        if self.pot:
            largest = 1 << self.max_size.bit_length() - 1
            return largest if largest >= self.multiple_of else 0
        return self.max_size // self.multiple_of * self.multiple_of

    def side(self, least: int, parts: int = 1) -> int:
        """Return the smallest side of at least ``least`` allowed, even above ``max_size``.

        It is a multiple of ``parts``, unless it must be a power of two and ``parts`` is none.
        """
        if self.pot:
            return 1 << (max(least, self.multiple_of) - 1).bit_length()
        step = math.lcm(self.multiple_of, parts)
        return -(-least // step) * step

    def room(self, side: int) -> int:
        """Return the part of a page's ``side`` for rectangles, each with padding at its end."""
        return side - 2 * self.border + self.padding

    def page(self, width: int, height: int) -> Size:
        """Return the smallest page for rectangles that take ``width`` × ``height`` with padding."""
        edges = 2 * self.border - self.padding
        size = self.side(width + edges), self.side(height + edges)
        return (max(size), max(size)) if self.square else size


@dataclass(frozen=True, slots=True)
class PackingUnits:
    """The lengths with which a sheet is packed, so that positions are whole px in every scale.

    Attributes:
        px: Length of a unit: this many px are 1 px in the smallest scale.
        edge: Width of the extruded edge of a frame, px, in whole units.
        rules: Limits on pages, in units.
    """

    px: int
    edge: int
    rules: PageRules

    @classmethod
    def of(cls, settings: Atlas) -> Self:
        """Convert the recipe's settings."""
        px = round(1 / settings.scales[-1])
        rules = PageRules(
            max_size=settings.max_size // px,
            padding=math.ceil(settings.padding / px),
            border=math.ceil(settings.border / px),
            multiple_of=settings.multiple_of,
            pot=settings.pot,
            square=settings.square,
            rotate=settings.rotate,
        )
        return cls(px, up_to(px, settings.extrude), rules)

    def size(self, width: int, height: int) -> Size:
        """Return the size, in units, of a trimmed frame of that size in px, with its edges."""
        return (width + 2 * self.edge) // self.px, (height + 2 * self.edge) // self.px
