"""Sizes that pages may have."""

import math
from dataclasses import dataclass

Size = tuple[int, int]
"""Width and height."""


_LONG, _LONG_COST = 3.0, 0.02
"""Pages more than so many times as long as wide count as larger, by this for each time more: they
run into the largest texture of a device before their area does."""


def effective_area(size: Size) -> float:
    """Return the area of a page, and somewhat more if it is very long."""
    aspect = max(size) / min(size)
    return size[0] * size[1] * (1 + _LONG_COST * max(aspect - _LONG, 0.0))


@dataclass(frozen=True, slots=True)
class PageRules:
    """Limits on pages as a recipe states them. All lengths in px, or all in another unit.

    Attributes:
        max_size: Largest side.
        padding: Empty space between neighbours.
        border: Empty space along every edge.
        multiple_of: Sides are multiples of this.
        pot: Sides are powers of two.
        square: Both sides are equal.
        rotate: Rectangles may be turned by 90°.
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
        """The largest side that is allowed; 0 where none is."""
        if self.pot:
            largest = 1 << self.max_size.bit_length() - 1
            return largest if largest >= self.multiple_of else 0
        return self.max_size // self.multiple_of * self.multiple_of

    def side(self, least: int, parts: int = 1) -> int:
        """Return the smallest side of at least ``least`` that is allowed, however large.

        It divides into ``parts``, unless it has to be a power of two and they are none.
        """
        if self.pot:
            return 1 << (max(least, self.multiple_of) - 1).bit_length()
        step = math.lcm(self.multiple_of, parts)
        return -(-least // step) * step

    def room(self, side: int) -> int:
        """Return how much of a page's ``side`` can be taken, with padding at the end of it."""
        return side - 2 * self.border + self.padding

    def page(self, width: int, height: int) -> Size:
        """Return the page on which so much is taken, with padding at the end of it."""
        edges = 2 * self.border - self.padding
        size = self.side(width + edges), self.side(height + edges)
        return (max(size), max(size)) if self.square else size
