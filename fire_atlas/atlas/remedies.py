"""What makes fewer pages enough: larger pages, or smaller or fewer frames, found by packing."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

from fire_atlas.atlas.grid import grid_pages
from fire_atlas.atlas.pack import fits_pages
from fire_atlas.atlas.page_rules import PackingUnits, Size
from fire_atlas.atlas.sheet import AtlasSheet, Region
from fire_atlas.recipe.output import Atlas

_STEP = 1.05
"""Factor between the sides of pages that are tried."""

_COARSE = 1.03
"""Factor between heights and numbers of frames that are tried, from the largest down. The largest
of which the area allows it is not tried: a page without any gap is hardly ever found."""

_GROWTH = 1.02
"""Frames that are made anew, smaller or fewer, may be this much larger than those that there are:
flakes fly elsewhere then."""


@dataclass(frozen=True, slots=True)
class PageFrames:
    """The frames of a sheet as they are packed.

    Attributes:
        sizes: Width and height of each trimmed frame, px.
        animations: Of each animation, the indices of its frames in ``sizes``.
        others: The same of each texture of flakes and each single sprite.
    """

    sizes: tuple[Size, ...]
    animations: tuple[Sequence[int], ...]
    others: tuple[Sequence[int], ...] = ()

    @classmethod
    def of(cls, sheet: AtlasSheet) -> Self:
        """Return the frames of a sheet; those that share a place are one."""
        places = dict[tuple[int, int, int], int]()
        sizes = list[Size]()

        def number(region: Region) -> int:
            place = region.page, region.x, region.y
            if place not in places:
                places[place] = len(sizes)
                sizes.append((region.width, region.height))
            return places[place]

        placed = (*sheet.regions, *sheet.singles, *sheet.cells)
        numbers = {region.name: number(region) for region in placed}
        textures = dict[str, list[int]]()
        for cell in sheet.cells:
            textures.setdefault(cell.name.rpartition("/")[0], []).append(numbers[cell.name])
        return cls(
            tuple(sizes),
            tuple(
                tuple(numbers[frame] for frame in animation.frames)
                for animation in sheet.animations
            ),
            (*((numbers[single.name],) for single in sheet.singles), *textures.values()),
        )

    def scaled(self, scale: float) -> Self:
        """Return the frames as large as they are at ``scale`` at most."""
        grown = scale * _GROWTH
        sizes = ((math.ceil(grown * w) + 1, math.ceil(grown * h) + 1) for w, h in self.sizes)
        return replace(self, sizes=tuple(sizes))

    def untrimmed(self, size: Size) -> Self:
        """Return the frames as large as they are untrimmed, px: none of their fire is larger."""
        return replace(self, sizes=(size,) * len(self.sizes))

    def shortened(self, count: int) -> Self:
        """Return ``count`` frames of each animation, as large as its largest: others may be chosen
        then."""
        sizes, animations = list(self.scaled(1).sizes), list[Sequence[int]]()
        for frames in self.animations:
            widths, heights = zip(*(sizes[frame] for frame in frames), strict=True)
            kept = len(set(frames[:count]))
            animations.append(range(len(sizes), len(sizes) + kept))
            sizes += [(max(widths), max(heights))] * kept
        return replace(self, sizes=tuple(sizes), animations=tuple(animations))

    def alone(self, animation: int) -> Self:
        """Return the frames of one animation; in a grid, others decide the size of their cells."""
        return replace(self, animations=(self.animations[animation],), others=())

    @property
    def shown(self) -> set[int]:
        """The indices of all frames."""
        return {frame for frames in (*self.animations, *self.others) for frame in frames}

    def could_fit(self, settings: Atlas, pages: int) -> bool:
        """Return whether so many ``pages`` have the area that they take."""
        units = PackingUnits.of(settings)
        padding, side = units.rules.padding, units.rules.room(units.rules.largest)
        sizes = [units.size(*self.sizes[frame]) for frame in self.shown]
        area = sum((width + padding) * (height + padding) for width, height in sizes)
        return area <= pages * side**2

    def fit(self, settings: Atlas, pages: int) -> bool:
        """Return whether so many ``pages`` surely hold them."""
        rules = PackingUnits.of(settings).rules
        sizes = [PackingUnits.of(settings).size(*size) for size in self.sizes]
        if (
            max(max(sizes[frame]) for frame in self.shown)
            > rules.room(rules.largest) - rules.padding
        ):
            return False
        animations = [*self.animations, *self.others]
        if settings.layout == "grid":
            return grid_pages(sizes, animations, rules) <= pages
        return fits_pages(sizes, animations, rules, pages)


def split_animations(sheet: AtlasSheet) -> list[int]:
    """Return the indices of the animations whose frames lie on several pages."""
    page = {region.name: region.page for region in sheet.regions}
    on_pages = [{page[frame] for frame in animation.frames} for animation in sheet.animations]
    return [i for i, pages in enumerate(on_pages) if len(pages) > 1]


def sufficient_size(frames: PageFrames, settings: Atlas, pages: int = 1) -> int | None:
    """Return an ``atlas.max_size``, px, with which so many ``pages`` are enough.

    It is at most 5 % above the least. None if the largest that a recipe may state is not enough.
    """
    units = PackingUnits.of(settings)
    rules = units.rules
    area = sum(math.prod(frames.sizes[i]) for i in frames.shown) / pages
    side = max(rules.largest + 1, round(math.sqrt(area) * _STEP**0.5) // units.px)
    while (size := rules.side(side) * units.px) <= settings.largest_size:
        if frames.fit(settings.model_copy(update={"max_size": size}), pages):
            return size
        side = math.ceil(rules.side(side) * _STEP)
    return None


def largest(holds: Callable[[int], bool], least: int, most: int) -> int | None:
    """Return a number from ``least`` to ``most`` that ``holds``: the largest, if all below it do.

    None if ``least`` does not.
    """
    if most < least or not holds(least):
        return None
    while least < most:
        middle = (least + most + 1) // 2
        if holds(middle):
            least = middle
        else:
            most = middle - 1
    return least


def nearly_largest(
    frames_at: Callable[[int], PageFrames], settings: Atlas, pages: int, least: int, most: int
) -> int | None:
    """Return a number from ``least`` to ``most`` whose frames fit so many ``pages``, hardly below
    the largest: only numbers whose area allows it are tried. None if those of ``least`` do not fit.

    Args:
        frames_at: Returns the frames of a number: of their height, or of how many there are.
        settings: The recipe's section.
        pages: Number of pages.
        least, most: Limits on the number.
    """
    tried = largest(lambda number: frames_at(number).could_fit(settings, pages), least, most)
    while tried is not None:
        tried = max(least, min(tried - 1, math.floor(tried / _COARSE)))
        if frames_at(tried).fit(settings, pages):
            return tried
        if tried == least:
            return None
    return None
