"""The page sizes that a recipe allows."""

import math
from dataclasses import dataclass
from typing import Self

from fire_atlas.atlas.trim import up_to
from fire_atlas.recipe.gpu import block_side
from fire_atlas.recipe.output import Atlas

Size = tuple[int, int]
"""Width and height."""


_LONG, _LONG_COST = 3.0, 0.02
"""Pages with an aspect above the first count as larger, by the second for each 1 of aspect more:
their long side is the first to exceed a device's maximum texture size."""

LEVELS_APART = 3
"""Mip levels of compressed textures at which frames stay apart by default: down to a quarter."""

_MOST_APART = 5
"""Maximum of these: at the fifth, a block covers 64 px of the page."""


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
        cells: Columns and rows of a grid; None: as many as frames need.
    """

    max_size: int
    padding: int = 0
    border: int = 0
    multiple_of: int = 1
    pot: bool = False
    square: bool = False
    rotate: bool = False
    cells: Size | None = None

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

    def least_area(self, covered: int, narrowest: int) -> float:
        """Return the area of the smallest page whose room for rectangles with their padding covers
        ``covered``, and is as wide and as high as ``narrowest``; infinity if no page is allowed
        that has so much."""
        edges, least = 2 * self.border - self.padding, math.inf
        short = self.side(narrowest + edges)
        while short <= self.largest:
            long = max(self.side(-(-covered // self.room(short)) + edges), short)
            if long <= self.largest and (long == short or not self.square):
                least = min(least, short * long)
            if long == short:
                break
            short = self.side(short + 1)
        return least


@dataclass(frozen=True, slots=True)
class PackingUnits:
    """The lengths with which a sheet is packed, so that positions are whole px in every scale.

    Attributes:
        step: This many px are 1 px in the smallest scale.
        px: Length of a unit, a multiple of ``step``: more than that for compressed textures.
        edge: Width of what belongs to a frame around it, px: its extruded edge, and for compressed
            textures the space that keeps it apart in mip levels.
        rules: Limits on pages, in units.
    """

    step: int
    px: int
    edge: int
    rules: PageRules

    @classmethod
    def of(cls, settings: Atlas) -> Self:
        """Convert the recipe's settings."""
        step = round(1 / settings.scales[-1])
        if settings.gpu:
            return cls._of_blocks(settings, step)
        padding, border = math.ceil(settings.padding / step), math.ceil(settings.border / step)
        rules = _rules(settings, step, padding, border, settings.multiple_of)
        return cls(step, step, up_to(step, settings.extrude), rules)

    @classmethod
    def _of_blocks(cls, settings: Atlas, step: int) -> Self:
        """Return the lengths for compressed textures.

        A cell is a frame with the space around it. It takes whole blocks at each mip level at which
        frames are to stay apart. Filtering reads one texel beyond a frame, so as much space, at the
        smallest of these levels, lies around it.
        """
        texel = step << levels_apart(settings) - 1
        blocks = _block_sides(settings)
        px = texel * blocks
        edge = up_to(texel, settings.extrude + max(texel, math.ceil(settings.padding / 2)))
        border = math.ceil(max(settings.border - edge, 0) / px)
        multiple_of = settings.multiple_of // math.gcd(settings.multiple_of, px // step)
        return cls(step, px, edge, _rules(settings, px, 0, border, multiple_of))

    def size(self, width: int, height: int) -> Size:
        """Return the size, in units, of a trimmed frame of that size in px, with its edges."""
        across, down = up_to(self.px, width + 2 * self.edge), up_to(self.px, height + 2 * self.edge)
        return across // self.px, down // self.px


def levels_apart(settings: Atlas) -> int:
    """Return at how many mip levels the layout has to keep frames apart."""
    return LEVELS_APART if settings.mips == "auto" else min(settings.mips, _MOST_APART)


def _block_sides(settings: Atlas) -> int:
    """Return the least common multiple of the sides of the blocks of all formats, px.

    Sides of pages that are powers of two have no room for whole blocks of 5 or 6 px.
    """
    sides = {block_side(format_) for format_ in settings.gpu}
    return max({4} | sides & {8}) if settings.pot else math.lcm(*sides)


def _rules(settings: Atlas, px: int, padding: int, border: int, multiple_of: int) -> PageRules:
    return PageRules(
        max_size=settings.max_size // px,
        padding=padding,
        border=border,
        multiple_of=multiple_of,
        pot=settings.pot,
        square=settings.square,
        rotate=settings.rotate,
        cells=None if settings.grid is None else (settings.grid.columns, settings.grid.rows),
    )
